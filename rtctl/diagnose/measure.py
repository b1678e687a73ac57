"""How far a model's simulation is from a recording, channel by channel, in the channel's own unit."""

from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer, UserError
from rtctl.diagnose.kernel import CLOSED, OPEN
from rtctl.diagnose.model import Model
from rtctl.diagnose.record import Record
from rtctl.diagnose.simulate import Simulator

RECTIFIED = ("reel1_counts", "reel2_counts")  # where their first edge lies is chance: compared up to a constant
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


def default_mode(record: Record) -> int:
    """CLOSED where the recorded machine's law is known, else OPEN."""
    return CLOSED if record.closed_loop else OPEN


def compare(record: Record, model: Model, mode: int | None = None, skip: int = 0) -> Comparison:
    """Simulate the whole recording freely and compare it from row `skip` on.

    OPEN runs on the recorded command, CLOSED on the reference with the known law, and then what the law writes is
    compared too. A counter that shows n stands for n + 1/2 on average. A recorded speed is compared with the
    difference quotient of the simulated position. Raises UserError where the law is not known or `skip` leaves less
    than two rows, NoAnswer where the model runs away.
    """
    mode = default_mode(record) if mode is None else mode
    n = len(record.t)
    if mode == CLOSED and not record.closed_loop:
        reason = next((w for w in record.case.warnings if "taken as the input" in w), "the law is not known")
        raise UserError(f"the loop cannot be closed: {reason}; simulate it with --open-loop")
    if not 0 <= skip <= n - 2:
        raise UserError(f"--skip {skip}: the recording has {n} rows, and at least two must be left")
    simulator = Simulator(record)
    readings, volts, _ = simulator.everything(model, mode)
    lost = np.flatnonzero(~np.isfinite(readings).all(axis=1))
    if len(lost):
        k = int(lost[0])
        raise NoAnswer(f"the model ran away at tick {k} ({record.t[k] - record.t[0]:.6g} s) in {NAMES[mode]}")
    channels = {}
    for column, name in enumerate(simulator.channels):
        seen = np.asarray(record.y[name], float) + simulator.half
        made = np.gradient(readings[:, column], record.dt) if name == "speed" else readings[:, column]
        seen, made = seen[skip:], made[skip:]
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
