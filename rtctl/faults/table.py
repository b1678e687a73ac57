"""Run of the table of faults: every fault on the shipped machines, one after the other."""

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from rtctl.faults import processes
from rtctl.faults.cases import STANDS, Stand
from rtctl.faults.drives import Inside, Processes
from rtctl.faults.play import Outcome, play, undisturbed
from rtctl.faults.processes import Survived


class Table(NamedTuple):
    """Outcomes of all faults."""

    outcomes: list[Outcome]
    survived: list[Survived]

    @property
    def ok(self) -> bool:
        """Whether no row before a fault is lost, every machine runs again, and every trip writes zero at once."""
        return all(o.lost == 0 and o.same and o.again and o.safe_from_trip in (0, None) for o in self.outcomes) and all(
            s.ok for s in self.survived
        )


def run(names: Sequence[str], say: Callable[[str], None] = lambda _: None, inside: bool = False) -> Table:
    """Table of every fault on the stands of these names, in lockstep, with the processes of the daemon.

    With `inside` the faults between loop and machine run in this process, in two threads that take turns.
    """
    outcomes, survived = [], []
    with tempfile.TemporaryDirectory(prefix="rtctl-faults-") as scratch:
        for name in names:
            stand, folder = STANDS[name], Path(scratch) / name
            folder.mkdir()
            outcomes += boundary(stand, None if inside else folder, say)
            survived += of_processes(stand, folder, say)
    return Table(outcomes, survived)


def boundary(stand: Stand, folder: Path | None, say: Callable[[str], None] = lambda _: None) -> list[Outcome]:
    """Outcomes of the faults between loop and machine: as processes that record into `folder`, else in this process."""
    truth, out = undisturbed(stand), []
    last = stand.ticks(stand.last)
    for case in stand.cases:
        say(f"{stand.name}: {case.title}")
        if folder is None:
            drive: Inside | Processes = Inside(stand.config([stand.fault(case)], loop__mode="lockstep"), last)
        else:
            config = processes.config(stand, [stand.fault(case)])
            drive = Processes(config, last, folder / f"{case.fault}-{case.channel}")
        with drive:
            out.append(play(stand, case, drive, truth))
    return out


def of_processes(stand: Stand, folder: Path, say: Callable[[str], None] = lambda _: None) -> list[Survived]:
    """Outcomes of the faults of processes; each run has its own folder."""
    truth, out = undisturbed(stand), []
    folders = [folder / name for name in ("side_by_side", "plant_killed", "plant_back", "supervisor_killed")]
    for each in folders:
        each.mkdir()
    say(f"{stand.name}: recorder.stall, clock.step, cpu.hog, disk.full")
    out += processes.side_by_side(stand, folders[0], truth)
    say(f"{stand.name}: plant.kill, supervisor.kill")
    out.append(processes.plant_killed(stand, folders[1], truth))
    out.append(processes.plant_back(stand, folders[2]))
    out.append(processes.supervisor_killed(stand, folders[3], truth))
    return out
