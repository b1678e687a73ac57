"""Proof on the running machine: former law, improved law, and runs of iterative learning.

Runs are recorded as `rtctl run` records them. A running machine has no truth columns: the error is that of its own
sensor. A run that trips ends the proof with the runs before it.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl import machines
from rtctl.config.load import set_paths
from rtctl.improve import learning, played
from rtctl.improve.improve import Improved
from rtctl.improve.played import Figures
from rtctl.improve.remedy import BASE
from rtctl.tick import safety
from rtctl.trace.bundle import load_bundle

ARMING = 2.0  # s
Run = Callable[[Any, Path, float], dict[str, Any]]


class Proof(NamedTuple):
    """Runs on the machine: name, figures, bundle; and the config of the best of them."""

    names: tuple[str, ...]
    figures: tuple[Figures, ...]
    bundles: tuple[Path, ...]
    config: Any

    @property
    def before(self) -> Figures:
        """Run of the former law."""
        return self.figures[0]

    @property
    def after(self) -> Figures:
        """The best run."""
        return min(self.figures[1:], key=lambda f: f.rms, default=self.figures[0])


def prove(
    r: Improved, machine: Any, folder: Path, runs: int = 0, progress: Callable[[str], None] = lambda _: None,
    run: Run | None = None,
) -> Proof:  # fmt: skip
    """Run the machine of `machine` (its link, board and clock) under its former law and under the improved law,
    then `runs` times more, each run learning from the run before.

    Raises UserError where the machine cannot be run, RunFailed where a run fails.
    """
    from rtctl.diagnose.answer.repair import run as record

    play = run or record
    before, after = (_on(machine, law) for law in (r.found.config, r.config))
    names: list[str] = []
    figures: list[Figures] = []
    bundles: list[Path] = []
    configs = [before]

    def one(name: str, config: Any) -> np.ndarray | None:
        progress(f"running the machine: {name}")
        bundle = folder / name
        seconds = played.seconds_of(config) + ARMING
        tripped = play(config, bundle, seconds)["tripped"] or ""
        found, error = _read(config, bundle, tripped)
        names.append(name)
        figures.append(found)
        bundles.append(bundle)
        return None if tripped else error

    one("before", before)
    error = one("improved", after)
    configs.append(after)
    crossover = r.margins_after.f_PM if r.margins_after is not None else 0.01 * after.loop.rate
    by = learning.learner(after, crossover, played.move_of(after))
    values = np.zeros(learning.count(by))
    kept, least = values, figures[-1].rms
    for number in range(runs):
        if error is None:
            break
        if figures[-1].rms <= least:
            kept, least = values, figures[-1].rms
            values = learning.learned(by, values, error[: round(by.duration / by.dt)])
        else:
            values = 0.5 * (kept + values)
        learns = {"duration": by.duration, "values": [float(f"{v:.5g}") for v in values]}
        config = set_paths(after, {f"{BASE}.learning": learns})
        error = one(f"learned-{number + 1}", config)
        configs.append(config)
    best = min(range(len(figures)), key=lambda i: figures[i].rms)
    return Proof(tuple(names), tuple(figures), tuple(bundles), configs[best])


def _on(machine: Any, law: Any) -> Any:
    """The config of a law on the machine that another config reaches: its clock, link, board, sockets and limits."""
    own = {name: getattr(machine, name) for name in ("name", "loop", "link", "driver", "commands", "safety", "record")}
    return law.model_copy(update=own)


def _read(config: Any, bundle: Path, tripped: str) -> tuple[Figures, np.ndarray]:
    """Figures of a recording by the machine's own sensor, and the error over the time that the reference played."""
    machine = machines.build(config)
    columns = load_bundle(bundle).columns
    running = np.flatnonzero(columns["state"] == safety.RUNNING)
    if tripped or not len(running):
        return played.figures_of(
            np.zeros(1), np.zeros(1), np.zeros(1), np.full(1, np.nan), np.zeros((1, 1)), tripped
        ), (np.zeros(1))
    rows = slice(running[0], running[0] + round(played.seconds_of(config) * machine.rate))
    ref, y = columns["ref"][rows], columns[machine.signals.position][rows]
    t = columns["t"][rows] - columns["t"][rows][0]
    outputs = np.array([columns[name][rows] for name in machine.signals.outputs])
    return played.figures_of(t, columns["target"][rows], ref, y, outputs, tripped), ref - y
