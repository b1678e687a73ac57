"""Checker of the invariants: rows in, violations out, with a bundle of the rows around each violation."""

import shutil
from collections import deque
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError
from rtctl.loop import generate
from rtctl.machines import Machine
from rtctl.soak import invariants, ranges
from rtctl.soak.invariants import NAMES, NEVER
from rtctl.tick import safety

MOST_KEPT = 20  # violations that are kept with a bundle
BEFORE, AFTER = 2.0, 0.5  # s of rows before and after a violation, in its bundle


class Violation(NamedTuple):
    """Violation of one invariant, from `tick` on."""

    name: str
    tick: int
    event: int
    seed: int
    value: float
    bound: float
    signals: dict[str, float]  # of the row; empty without a row
    bundle: str | None  # folder

    def as_json(self) -> dict[str, Any]:
        return self._asdict()


class Checker:
    """Checks every row of a soak. The player of the day (`Day`) writes its expectations to `windows`.

    Rows checked and rows lost in the ring must sum to the ticks of the loop.
    """

    def __init__(self, machine: Machine, made: generate.Generated, out: Path, seed: int):
        self.machine, self.made, self.out, self.seed = machine, made, out, seed
        self.range = ranges.range_of(machine)
        self.w, self.s = np.zeros(1, invariants.WINDOWS), np.zeros(1, invariants.CARRY)
        self._found = np.zeros(invariants.MOST_FOUND, invariants.FOUND)
        self._fill(self.w[0])
        self.s["last_bad"] = -NEVER
        self.event = 0
        self.count = 0
        self.kept: list[Violation] = []
        self.captures: list[str] = []
        self.last: Any = None
        self._history: deque[np.ndarray] = deque()
        self._waiting: list[tuple[int, int, Path]] = []  # first and last tick of a bundle, and its folder

    @property
    def windows(self) -> Any:
        """Record of WINDOWS: the player's expectations for the coming ticks."""
        return self.w[0]

    @property
    def carry(self) -> Any:
        return self.s[0]

    def _fill(self, w: Any) -> None:
        machine, r = self.machine, self.range
        config, limits = machine.config, machine.config.safety
        p = safety.build(limits, machine.dt)
        names = list(self.made.row.names or ())
        place = {name: i for i, name in enumerate(names)}
        for field, column in (
            ("state", "state"), ("trip", "trip"), ("age", "link_age"), ("lateness", "lateness"), ("order", "order"),
            ("position", r.position), ("error", r.error), ("counts", r.counts),
        ):  # fmt: skip
            w[field] = place[column]
        per_unit = ranges.counts_per_unit(config)
        empty = ranges.unknown(config) & set(place)
        w["n_empty"] = len(empty)
        w["empty"][: len(empty)] = sorted(place[name] for name in empty)
        knows = r.truth in place and r.truth not in empty and np.isfinite(per_unit)
        w["truth"] = place[r.truth] if knows else -1
        w["per_unit"] = per_unit if knows else 0.0
        w["counts_off"] = r.stretch
        w["n_outputs"] = len(r.outputs)
        w["outputs"][: len(r.outputs)] = [place[name] for name in r.outputs]
        tensions = [*r.tensions, *(r.truth_tensions if set(r.truth_tensions) <= place.keys() - empty else ())]
        w["n_tensions"] = len(tensions)
        w["tensions"][: len(tensions)] = [place[name] for name in tensions]
        w["low"], w["high"] = ranges.volts(config)
        w["rounding"] = ranges.rounding(config)
        w["fade"] = p.fade
        w["tension_min"], w["tension_max"], w["tension_ticks"] = p.tension_min, p.tension_max, p.tension
        w["link_ticks"] = min(p.link, round(invariants.LONGEST_LINK * machine.rate))
        w["following"], w["missed"] = p.following, p.missed
        w["late"] = config.loop.late * machine.dt
        w["tolerance"] = r.tolerance
        w["settled_from"] = w["must_by"] = NEVER
        w["quiet_from"] = w["counts_from"] = NEVER if machine.faults else 0

    def feed(self, rows: np.ndarray) -> None:
        """Check rows (n,), in order. The rows are kept for bundles and must not be changed afterwards."""
        if not len(rows):
            return
        width = rows.dtype.itemsize // 8
        flat = rows.view(np.float64).reshape(len(rows), width)  # the integer `tick` reads as a tiny finite float
        self.s["found"] = 0
        invariants.check(flat, rows["tick"], self.w, self.s, self._found)
        self.last = rows[-1]
        self._remember(rows)
        for found in self._found[: int(self.s["found"][0])]:
            at = np.searchsorted(rows["tick"], found["tick"])
            self._keep(NAMES[found["code"]], int(found["tick"]), float(found["value"]), float(found["bound"]),
                       rows[min(at, len(rows) - 1)])  # fmt: skip
        self._finish_bundles(int(self.s["tick"][0]))
        self.count = int(self.s["episodes"].sum())

    def note_lost(self, first: int, count: int) -> None:
        """Count rows that the ring lost, so that their tick numbers are no violation."""
        self.s["lost"] += count
        self.s["tick"] = first + count

    def account(self, ticks: int) -> None:
        """Compare rows checked and rows lost with the `ticks` of the loop; a difference is a violation of `ring`."""
        seen = int(self.s["rows"][0] + self.s["lost"][0])
        if seen != ticks:
            self.note("ring", ticks, float(seen), float(ticks))

    def note(self, name: str, tick: int, value: float, bound: float) -> None:
        """Note a violation that is not visible in a single row."""
        self.s["episodes"][0, NAMES.index(name)] += 1
        self.count += 1
        self._keep(name, tick, value, bound, self.last)

    def checked(self, name: str, ticks: int = 1) -> None:
        """Count ticks for an invariant that is checked outside the compiled pass."""
        self.s["checked"][0, NAMES.index(name)] += ticks

    def capture(self, first: int, last: int, name: str) -> None:
        """Request a bundle of the rows from tick `first` to `last`, as a person would capture them."""
        folder = self.out / name
        self.captures.append(folder.name)
        self._waiting.append((first, last, folder))

    def flush(self) -> None:
        """Write the bundles that still wait for rows, with the rows so far."""
        self._finish_bundles(NEVER)

    def _keep(self, name: str, tick: int, value: float, bound: float, row: Any) -> None:
        if len(self.kept) >= MOST_KEPT:
            return
        folder = self.out / f"violation-{len(self.kept) + 1:02d}-{name}"
        signals = {} if row is None else {n: float(row[n]) for n in row.dtype.names}
        self.kept.append(Violation(name, tick, self.event, self.seed, value, bound, signals, folder.name))
        rate = self.machine.rate
        self._waiting.append((tick - round(BEFORE * rate), tick + round(AFTER * rate), folder))

    def _remember(self, rows: np.ndarray) -> None:
        self._history.append(rows)
        most = (BEFORE + AFTER) * self.machine.rate
        held = sum(map(len, self._history))
        while len(self._history) > 1 and held - len(self._history[0]) >= most:
            held -= len(self._history.popleft())

    def _finish_bundles(self, tick: int) -> None:
        if not self._waiting:
            return
        from rtctl.daemon.case import describe
        from rtctl.trace.recorder import Recorder

        for first, last, folder in [b for b in self._waiting if tick > b[1]]:
            rows = np.concatenate(self._history) if self._history else np.zeros(0, self.made.row)
            rows = rows[(rows["tick"] >= first) & (rows["tick"] <= last)]
            case = {**describe(self.machine, self.made), "soak": {"seed": self.seed, "name": folder.name}}
            if _of_a_soak(folder):  # left by a killed soak that resumed from an earlier progress file
                shutil.rmtree(folder)
            try:
                recorder = Recorder(folder, self.made.columns, self.made.row, case)
                recorder.put(rows)
                recorder.finish()
            except OSError as error:
                raise UserError(f"{folder}: the disk did not take it: {error.strerror or error}") from error
        self._waiting = [b for b in self._waiting if tick <= b[1]]


def _of_a_soak(folder: Path) -> bool:
    """Whether a folder is a bundle of a soak."""
    from rtctl.trace.bundle import load_case

    try:
        return "soak" in load_case(folder)
    except UserError:
        return False
