"""Comparison of a simulation with a recording: both signals of each channel, and their rms difference."""

from typing import Any, NamedTuple

import numpy as np

NAMES = {False: "open loop", True: "closed loop"}


class Channel(NamedTuple):
    """Recorded and simulated signal over the rows that count."""

    recorded: np.ndarray  # (n,)
    simulated: np.ndarray
    unit: str

    @property
    def rmse(self) -> float:
        """Root mean square of the difference, in `unit`."""
        return float(np.sqrt(np.mean((self.simulated - self.recorded) ** 2)))

    @property
    def nrmse(self) -> float:
        """Rmse by the standard deviation of the recorded signal; nan where the recorded signal is constant."""
        spread = float(np.std(self.recorded))
        return self.rmse / spread if spread > 0.0 else float("nan")


class Comparison(NamedTuple):
    """Every channel of a free run."""

    t: np.ndarray  # (n,) s
    channels: dict[str, Channel]
    closed: bool  # whether a law closed the loop; False: the recorded commands were the input
    skipped: int  # rows at the start that are excluded

    @property
    def mode(self) -> str:
        """Mode of the loop in words."""
        return NAMES[self.closed]

    def as_json(self) -> dict[str, Any]:
        """Output of `rtctl simulate --json`."""
        return {
            "rmse": {name: c.rmse for name, c in self.channels.items()},
            "nrmse": {name: c.nrmse for name, c in self.channels.items()},
            "unit": {name: c.unit for name, c in self.channels.items()},
            "skipped": self.skipped,
        }
