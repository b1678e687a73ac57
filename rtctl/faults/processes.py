"""Faults of the processes of the daemon. A run, or a part of a run, proves that the daemon survives each fault."""

import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl import machines
from rtctl.config.errors import UserError
from rtctl.config.isolated import python
from rtctl.config.load import to_yaml
from rtctl.daemon.shared_memory import remove, segment_path
from rtctl.daemon.supervisor import Supervisor
from rtctl.faults.cases import Stand
from rtctl.faults.drives import again
from rtctl.faults.play import same
from rtctl.loop import generate
from rtctl.loop.records import layout
from rtctl.tick import safety
from rtctl.tick.memory import Segment
from rtctl.trace.bundle import load_bundle
from rtctl.trace.repair import repair

PATIENCE = 120.0  # s, time limit on a busy computer
NO_LIMITS = {  # on the wall clock of a busy computer only the fault may trip
    "safety__link_timeout": 3.0, "safety__missed_ticks": 0, "safety__following_error": 0.0, "safety__frozen_time": 0.0,
    "safety__current_time": 0.0, "safety__disagreement": 0.0, "safety__tension_min": -1e9, "safety__tension_max": 1e9,
    "loop__realtime": "off",
}  # fmt: skip


class Survived(NamedTuple):
    """Fault of a process and its consequences in words, proved by the run where `ok`."""

    machine: str
    fault: str
    mode: str
    seen: str  # place where a person sees the fault
    outputs: str  # consequence for the outputs
    lost: str  # lost rows
    ok: bool


@contextmanager
def _running(config: Any, out: Path, ticks: int) -> Iterator[Supervisor]:
    supervisor = Supervisor(config, out, ticks)
    supervisor.armed_at_start = True
    with supervisor:
        yield supervisor


def side_by_side(stand: Stand, folder: Path, truth: Any) -> list[Survived]:
    """Faults of recorder, disk, clock and CPUs in one run in lockstep; no fault may reach the loop."""
    third, last = stand.last / 3, stand.ticks(stand.last)
    faults = [
        {"fault": "recorder.stall", "at": 0.5 * third, "lasts": third},
        {"fault": "clock.step", "at": 0.6 * third, "lasts": third},
        {"fault": "cpu.hog", "at": 0.7 * third, "lasts": third, "size": 2.0},
        {"fault": "disk.full", "at": 2.0 * third},
    ]
    full = stand.ticks(2.0 * third)
    queued = 0
    with _running(config(stand, faults), folder / "bundle", last) as supervisor:
        for _ in supervisor.run():
            assert supervisor.recorder is not None
            active = [f["fault"] for f in supervisor.faults.handle("list", None)["faults"] if f["active"]]
            stalled = "recorder.stall" in active
            queued = max(queued, supervisor.recorder.stats().rows_queued if stalled else 0)
        supervisor.stop()
        supervisor.finish()
        found = supervisor.snapshot()
    rows = load_bundle(folder / "bundle").columns
    kept = len(rows["tick"])
    whole = found["ticks"] == last and found["trip"] is None and same(rows, truth, full)
    exact = kept == full and found["rows"]["lost"] == last - full

    def row(fault: str, seen: str, lost: str, ok: bool) -> Survived:
        done = any(told["fault"] == fault for told in found["faults"])
        return Survived(stand.name, fault, "lockstep", seen, "untouched: the run goes on", lost, done and whole and ok)

    return [
        row("recorder.stall", "`status`: `rows.queued` grows", "nothing: 64 MB of rows wait for the disk", queued > 0),
        row("clock.step", "nowhere", "nothing: all runs on CLOCK_MONOTONIC", True),
        row("cpu.hog", "in real time: late ticks, at worst `missed_ticks`", "nothing", True),
        row("disk.full", f"`status`: `rows.error` is \"{found['rows']['error']}\"", "the rows after the fault, counted",
             exact and "space" in str(found["rows"]["error"])),
    ]  # fmt: skip


def plant_killed(stand: Stand, folder: Path, truth: Any) -> Survived:
    """Killed plant in lockstep: time stops without the plant, and the run ends with a reason."""
    begin = stand.ticks(stand.begin)
    made = config(stand, [{"fault": "plant.kill", "at": stand.begin}])
    with _running(made, folder / "bundle", stand.ticks(stand.last)) as supervisor:
        for _ in supervisor.run():
            pass
        supervisor.stop()
        supervisor.finish()
        found = supervisor.snapshot()
    rows = load_bundle(folder / "bundle").columns
    ok = found["ticks"] == len(rows["tick"]) == begin and same(rows, truth, begin)
    said = found["faults"][-1]["what"]
    return Survived(stand.name, "plant.kill", "lockstep", said, "there is no machine any more", "nothing", ok)


def plant_back(stand: Stand, folder: Path, link: str = "shm") -> Survived:
    """Killed plant on the wall clock: the loop trips, and runs again with a new plant whose counters begin at zero."""
    made = config(
        stand, [{"fault": "plant.kill", "at": 1.0, "lasts": 4.0}], loop__mode="real", link__kind=link, **NO_LIMITS
    )
    with _running(made, folder / "bundle", 0) as supervisor:
        turns, status = supervisor.run(), supervisor.status
        first = supervisor.plant
        until(lambda: status["trip"] and supervisor.plant is not first, turns)
        until(lambda: supervisor.last_row["link_age"] == 0.0, turns)  # the new plant answers
        came = int(status["tick"])
        until(taken_up(supervisor, stand.ticks(1.0)), turns)
        moving = int(status["tick"]) + stand.ticks(1.0)
        until(lambda: int(status["tick"]) > moving or status["state"] == safety.TRIPPED, turns)
        supervisor.stop()
        supervisor.finish()
    rows = load_bundle(folder / "bundle").columns
    return Survived(
        stand.name,
        "plant.kill",
        "real",
        f"`link_lost` after {_limit(made)} ticks without a frame (`safety.link_timeout`)",
        "zero in the tick of the trip; after reset and arm it holds where the new plant stands, and moves again",
        "nothing",
        _back(stand, rows, came, _limit(made)),
    )


def _back(stand: Stand, rows: Any, came: int, limit: int) -> bool:
    k = int(np.argmax(rows["state"] == safety.TRIPPED))
    on = int(np.argmax((rows["tick"] > rows["tick"][k]) & (rows["state"] == safety.ARMED)))
    off = slice(k, on)
    return bool(
        safety.TRIPS[int(rows["trip"][k])][0] == "link_lost"
        and rows["link_age"][k - 1] <= limit < rows["link_age"][k]  # link_age in periods: a late tick may skip several
        and not any(rows[name][off].any() for name in stand.outputs)
        and rows["tick"][on] >= came
        and rows[stand.error][on] == 0.0
        and rows["state"][-1] == safety.RUNNING
    )


def _limit(config: Any) -> int:
    return round(config.safety.link_timeout * config.loop.rate)


def supervisor_killed(stand: Stand, folder: Path, truth: Any) -> Survived:
    """Killed supervisor (SIGKILL): the rows that the recording lacks are in shared memory, to the last tick."""
    begin = stand.ticks(stand.begin)
    made = config(stand, [{"fault": "supervisor.kill", "at": stand.begin}])
    path, bundle = folder / "config.yaml", folder / "bundle"
    path.write_text(to_yaml(made))
    order = python("-m", "rtctl.cli.main", "run", str(path), "--for", f"{stand.last}s")
    code = subprocess.run([*order, "--out", str(bundle), "--no-plot", "--json"], capture_output=True).returncode
    left = _left(made)
    ended = left is not None and code == -signal.SIGKILL
    recorded = repair(bundle).rows if ended else 0
    found = np.asarray([]) if left is None else left
    ok = ended and recorded <= begin and len(found) == begin and same(found, truth, begin)
    ok = ok and (not recorded or same(load_bundle(bundle).columns, truth, recorded))
    return Survived(
        stand.name, "supervisor.kill", "lockstep", "nobody answers the command socket",
        "the loop ends; on the wall clock it writes zeros first", "at most the last batch, which shared memory has", ok,
    )  # fmt: skip


def _left(config: Any) -> Any:
    """Rows in the shared memory of a killed supervisor after the end of its loop; the segment is removed."""
    machine = machines.build(config)
    made = generate.generate(machine, "shm")
    rows = max(int(config.record.seconds * machine.rate), 1000)
    where = segment_path(config.name)
    try:
        segment = Segment.open(where, layout(made.params, made.tables, made.row, rows))
    except FileNotFoundError:
        return None
    deadline = time.monotonic() + PATIENCE
    while not segment["status"][0]["ended"] and time.monotonic() < deadline:
        time.sleep(0.01)
    ticks = int(segment["ring"][0]["head"])
    remove(where)
    return segment["rows"][:ticks].copy() if segment["status"][0]["ended"] and ticks <= rows else None


def config(stand: Stand, faults: list[dict[str, Any]], **changes: Any) -> Any:
    name = f"faults-{stand.name}-{time.monotonic_ns() % 10**9}"
    return stand.config(faults, **{"name": name, "loop__mode": "lockstep", "record__seconds": 20.0, **changes})


def taken_up(supervisor: Supervisor, patience: int) -> Callable[[], bool]:
    """Predicate that resets and arms a tripped loop, and is true once the loop runs.

    The order is repeated after `patience` ticks: a busy computer may lose the link once more before the machine moves.
    """
    status, asked = supervisor.status, -patience

    def running() -> bool:
        nonlocal asked
        tick = int(status["tick"])
        if status["state"] == safety.TRIPPED and tick - asked >= patience:
            supervisor.order(again)
            asked = tick
        return bool(status["state"] == safety.RUNNING)

    return running


def until(what: Callable[[], Any], turns: Iterator[None]) -> None:
    """Take turns until `what` is true. Raises UserError at the end of the run or of PATIENCE."""
    deadline = time.monotonic() + PATIENCE
    while not what():
        if next(turns, turns) is turns or time.monotonic() > deadline:
            raise UserError("the run ended, or timed out, before the awaited event")
