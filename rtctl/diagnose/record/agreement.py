"""Agreement of a law, recomputed from the recorded columns, with the recorded command."""

from typing import NamedTuple

import numpy as np

AGREES_RMS = 0.02  # of the command's spread: rms difference up to which the law is accepted
AGREES_MEDIAN = 2e-3  # of the command's spread: median difference up to which the law is accepted
SAME = 1e-9  # in units of the command: difference by rounding


class Agreement(NamedTuple):
    """Difference of a recomputed law from the recorded command."""

    share: float  # of rows that are equal to within SAME
    nrmse: float  # rms difference by the command's spread
    median: float  # median difference by the command's spread
    worst: float  # largest difference, in units of the command
    worst_row: int

    @property
    def exact(self) -> bool:
        return self.share == 1.0

    @property
    def holds(self) -> bool:
        return self.exact or (self.nrmse < AGREES_RMS and self.median < AGREES_MEDIAN)


def agreement(again: np.ndarray, recorded: np.ndarray) -> Agreement:
    """Agreement of recomputed with recorded commands, (n, drives) each; a non-finite command is off by inf."""
    off = np.abs(again - recorded)
    off[~np.isfinite(off)] = np.inf
    spread = float(np.sqrt(np.sum(np.var(recorded, axis=0)))) or 1.0
    rows = off.max(axis=1)
    rms = float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
    worst = int(np.argmax(rows))
    return Agreement(
        float(np.mean(rows < SAME)), rms / spread, float(np.median(rows)) / spread, float(rows[worst]), worst
    )


def disagrees(kind: str, found: Agreement | None, unit: str) -> str:
    """Sentence, without its full stop, on a law that does not give the recorded command; None for `found`: the law
    cannot be recomputed."""
    if found is None:
        return f"the law '{kind}' cannot be recomputed from this recording"
    return (
        f"the law '{kind}' does not give the recorded command (off by {found.worst:.3g} {unit} "
        f"in row {found.worst_row}, {100 * found.nrmse:.2g} % rms)"
    )
