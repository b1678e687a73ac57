"""How far a model's simulation is from a recording, channel by channel, in the channel's own unit.

A recording of an axis may begin in the middle of a motion. A free run of it begins as the recording does: with the
position and speed from which the model passes the first rows best, as benchmarks of system identification have it.
"""

import copy
from types import ModuleType
from typing import Any, NamedTuple, cast

import numpy as np

from rtctl.config.errors import NoAnswer, UserError
from rtctl.diagnose.emulate import can_emulate, emulate
from rtctl.diagnose.kernel import CLOSED, OPEN
from rtctl.diagnose.model import Model
from rtctl.diagnose.record import Record
from rtctl.diagnose.simulate import Simulator
from rtctl.trace.bundle import Bundle

RECTIFIED = ("reel1_counts", "reel2_counts")  # where their first edge lies is chance: compared up to a constant
FIRST = 20  # rows that the first position and speed of an axis are taken from
ROUNDS = 3  # of that: the error of so few rows is all but linear in them
NAMES = {OPEN: "open loop", CLOSED: "closed loop"}


class Channel(NamedTuple):
    """Both signals over the rows that count."""

    recorded: np.ndarray  # (n,)
    simulated: np.ndarray
    unit: str

    @property
    def rmse(self) -> float:
        return float(np.sqrt(np.mean((self.simulated - self.recorded) ** 2)))

    @property
    def nrmse(self) -> float:
        """By the standard deviation of the recorded signal over the same rows; nan where that stands still."""
        spread = float(np.std(self.recorded))
        return self.rmse / spread if spread > 0.0 else float("nan")


class Comparison(NamedTuple):
    t: np.ndarray  # (n,) s
    channels: dict[str, Channel]
    mode: int  # OPEN or CLOSED
    skipped: int  # rows at the start that do not count

    def as_json(self) -> dict[str, Any]:
        """What `rtctl simulate --json` prints."""
        return {
            "rmse": {name: c.rmse for name, c in self.channels.items()},
            "nrmse": {name: c.nrmse for name, c in self.channels.items()},
            "unit": {name: c.unit for name, c in self.channels.items()},
            "skipped": self.skipped,
        }


class Begun:
    """A kernel's module whose machine is on its way when the simulation begins."""

    def __init__(self, module: ModuleType, x: np.ndarray):
        self.module, self.x = module, x

    def run(self, job: np.ndarray, p: np.ndarray, s: np.ndarray, *others: Any) -> int:
        """As the module's own, from the position and speed in `x` (2,)."""
        s["m"]["x"][0, : len(self.x)] = self.x
        s["m"]["v_before"][0, 0] = self.x[1]
        return int(self.module.run(job, p, s, *others))


def begin(sim: Simulator, model: Model, rows: int = FIRST) -> np.ndarray | None:
    """Position and speed (2,) of an axis from which its free run passes the first `rows` rows best.

    Gauss-Newton from the first reading at rest, or from the first speed either way, since its sensor may not know
    direction. None where the machine is no axis, and where the model runs away: it begins at rest then.
    """
    if sim.record.plant != "axis":
        return None
    rows = min(rows, len(sim.seen))
    if not sim.record.shows_speed:
        return _begin(sim, model, rows, np.array([sim.seen[0], 0.0]))
    found = [_begin(sim, model, rows, np.array([0.0, v])) for v in (sim.seen[0], -sim.seen[0])]
    ways = [x for x in found if x is not None]
    errors = [float(np.sum((sim.seen[:rows] - free_run(sim, model, x, rows)[:, 0]) ** 2)) for x in ways]
    return ways[int(np.argmin(errors))] if ways else None


def _begin(sim: Simulator, model: Model, rows: int, x: np.ndarray) -> np.ndarray | None:
    """The same from a first guess `x`."""
    seen, per_s = sim.seen[:rows], 1.0 / (rows * sim.record.dt)
    steps = max(float(np.ptp(seen)), 1e-9) * np.array([1.0 / per_s, 1.0] if sim.record.shows_speed else [1.0, per_s])
    for _ in range(ROUNDS):
        e = seen - free_run(sim, model, x, rows)[:, 0]
        columns = [(seen - free_run(sim, model, x + step, rows)[:, 0] - e) for step in np.diag(steps)]
        J = np.stack(columns, axis=1)
        if not np.isfinite(J).all():
            return None
        x = x - steps * np.linalg.lstsq(J, e, rcond=None)[0]
    return x


def free_run(
    sim: Simulator, model: Model, start: np.ndarray | None, n: int | None = None, coarse: bool = False
) -> np.ndarray:
    """Readings (n, sensors) under the recorded command alone, from `start` (see `begin`); None starts at rest."""
    if start is None:
        return sim.run(model, OPEN, n, coarse)
    moving = copy.copy(sim)
    moving.kernel = sim.kernel._replace(module=cast(ModuleType, Begun(sim.kernel.module, start)))
    out = moving.run(model, OPEN, n, coarse)
    return out if sim.record.shows_speed else out + start[0]  # readings of a position count from where it began


def between(record: Record, model: Model) -> Simulator:
    """What the command did between its samples nobody wrote down: of a machine without a controller it was held or it
    was smooth, whichever suits the model better."""
    held = Simulator(record)
    if record.case.controller.kind != "none":
        return held
    smooth = Simulator(record, held=False)

    def error(sim: Simulator) -> float:
        return float(np.mean((free_run(sim, model, begin(sim, model))[:, 0] - sim.seen) ** 2))

    return smooth if error(smooth) < error(held) else held  # a model that runs away is held


def default_mode(record: Record, bundle: Bundle | None = None) -> int:
    """CLOSED where the law is known or the tick of the bundle's config gave the command to the bit, else OPEN."""
    return CLOSED if record.closed_loop or ticks_again(record, bundle) else OPEN


def ticks_again(record: Record, bundle: Bundle | None) -> bool:
    """Whether the tick of the bundle's config can close the loop: its law gives the recorded command to the bit."""
    replayed = record.replay is not None and record.replay.identical
    return bundle is not None and (record.closed_loop or replayed) and can_emulate(bundle)


def compare(
    record: Record, model: Model, mode: int | None = None, skip: int = 0, bundle: Bundle | None = None
) -> Comparison:
    """Simulate the whole recording freely and compare it from row `skip` on.

    OPEN runs on the recorded command, an axis from the position and speed that its first 20 rows show (the first `skip`
    if those are more); CLOSED on the reference with the known law, and then what the law writes is compared too. With
    the `bundle` of a recording of our own, CLOSED is the machine of its config with the model as its plant. A
    counter that shows n stands for n + 1/2 on average. Raises UserError where the law is not known or `skip` leaves
    less than two rows, NoAnswer where the model runs away.
    """
    mode = default_mode(record, bundle) if mode is None else mode
    n = len(record.t)
    ticks = mode == CLOSED and ticks_again(record, bundle)
    if mode == CLOSED and not record.closed_loop and not ticks:
        reason = next((w for w in record.case.warnings if "taken as the input" in w), "the law is not known")
        raise UserError(f"the loop cannot be closed: {reason}; simulate it with --open-loop")
    if not 0 <= skip <= n - 2:
        raise UserError(f"--skip {skip}: the recording has {n} rows, and at least two must be left")
    simulator = between(record, model)
    volts = np.zeros((n, 0))
    if ticks:
        assert bundle is not None  # ticks_again
        found = emulate(bundle, record, model)
        readings = np.column_stack([found[name] + simulator.half for name in simulator.channels])
        volts = np.column_stack([found[name] for name in record.commands])
    elif mode == OPEN:
        readings = free_run(simulator, model, begin(simulator, model, max(FIRST, skip)))
    else:
        readings, volts, _ = simulator.everything(model, mode)
    lost = np.flatnonzero(~np.isfinite(readings).all(axis=1))
    if len(lost):
        k = int(lost[0])
        raise NoAnswer(f"the model ran away at tick {k} ({record.t[k] - record.t[0]:.6g} s) in {NAMES[mode]}")
    channels = {}
    for column, name in enumerate(simulator.channels):
        seen = np.asarray(record.y[name], float) + simulator.half
        seen, made = seen[skip:], readings[skip:, column]
        if name in RECTIFIED:
            made = made + np.mean(seen - made)
        channels[name] = Channel(seen, made, _unit(record, name))
    if mode == CLOSED:
        for column, name in enumerate(record.commands):
            channels[name] = Channel(record.u[skip:, column], volts[skip:, column], record.case.drive.unit)
    return Comparison(record.t[skip:], channels, mode, skip)


def _unit(record: Record, name: str) -> str:
    if name.endswith("_counts"):
        return "counts"
    unit = record.case.sensors.unit or "m"
    return f"{unit}/s" if name == "speed" else unit
