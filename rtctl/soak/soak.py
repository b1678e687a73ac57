"""A soak from start to end: play the day, check it, save the progress, and write the summary."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError
from rtctl.config.files import write_text
from rtctl.soak import progress, ranges, report
from rtctl.soak.events import Day
from rtctl.soak.memory import Memory
from rtctl.soak.rig import Fused

SAVE = 10.0  # s of wall time between two writes of the progress file
Update = Callable[[int, int, int], None]  # ticks done, total ticks, violations


def soak(
    config: Any,
    hours: float,
    seed: int,
    with_faults: bool,
    out: Path,
    resume: bool = False,
    update: Update = lambda *_: None,
    stopped: Callable[[], bool] = lambda: False,
) -> dict[str, Any]:
    """Play `hours` of a random day in the mode of the config; returns the summary and writes it to `out`.

    The soak ends between events once `stopped()` is true; in mode fused it can be resumed. Raises UserError for a
    folder that holds another soak, or for a resume in another mode.
    """
    mode = config.loop.mode
    if resume and mode != "fused":
        raise UserError(f"--resume: a soak in mode {mode} cannot be resumed; its machine is another process")
    if not resume and (out / progress.PROGRESS).exists():
        raise UserError(f"{out} holds a soak already; go on with --resume, or choose another --out")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"--out {out}: cannot be made: {error.strerror}") from None
    config = ranges.with_reference(config)
    if mode == "fused":
        return _fused(config, hours, seed, with_faults, out, resume, update, stopped)
    from rtctl.soak.live import Live

    with Live(config, out, seed) as rig:
        day = Day(rig, seed, with_faults)
        return _play(day, hours, out, 0.0, mode, update, stopped)


def _fused(
    config: Any, hours: float, seed: int, with_faults: bool, out: Path, resume: bool, update: Update,
    stopped: Callable[[], bool],
) -> dict[str, Any]:  # fmt: skip
    rig = Fused(config, out, seed)
    day = Day(rig, seed, with_faults)
    spent = progress.load(out, rig, day) if resume else 0.0
    return _play(day, hours, out, spent, "fused", update, stopped)


def _play(
    day: Day, hours: float, out: Path, spent: float, mode: str, update: Update, stopped: Callable[[], bool]
) -> dict[str, Any]:
    rig = day.rig
    total = max(round(hours * 3600.0 * rig.machine.rate), 1)
    first = rig.tick
    _warm()
    memory = Memory()
    begun = saved = time.monotonic()
    while rig.tick < total and not stopped():
        day.step()
        memory.sample((rig.tick - first) / max(total - first, 1), rig.checker, rig.tick)
        update(min(rig.tick, total), total, rig.checker.count)
        if isinstance(rig, Fused) and time.monotonic() - saved > SAVE:
            saved = time.monotonic()
            progress.save(out, rig, day, spent + saved - begun)
    rig.finish()
    rig.checker.flush()
    wall = spent + time.monotonic() - begun
    if isinstance(rig, Fused):
        progress.save(out, rig, day, wall)
    found = report.summary(day, wall, memory.most, mode, out)
    found["complete"] = rig.tick >= total
    try:
        write_text(out / report.SUMMARY, report.as_text(found))
    except OSError as error:
        raise UserError(f"{out / report.SUMMARY}: cannot be written: {error.strerror}") from None
    return found


def _warm() -> None:
    """Import modules of the first bundle now, so that their memory counts as start-up memory."""
    import rtctl.daemon.case
    import rtctl.trace.recorder  # noqa: F401
