"""Error table: position estimate corrected by a table of its periodic error.

    x_hat = R_c theta_m + e_hat(R_c theta_m)            e_hat periodic, a straight line between its values

The table covers one period of the estimate, as a rule a turn of the capstan, 2 pi R_c. Its phase refers to the angle
at which the counter is 0. The table is valid as long as the counter keeps its count, or permanently with an absolute
encoder. A table of a wrong phase makes the error larger, so the table must be made anew at every start.

Source: thesis 11.3, (11.11), (11.12). `design/error_table` makes the table from a scale or from a printed image.
"""

from math import floor
from typing import NamedTuple

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings, quantity, tick

MOST = 256  # values in a table


class ErrorTableSettings(Settings):
    period: float = quantity(unit="m", gt=0, help="travel after which the error repeats: 2 pi R_c for a turn")
    values: list[float] = Field(
        min_length=2, max_length=MOST, description="m, to add to the estimate, evenly over the period, from position 0"
    )


class ErrorTableParams(NamedTuple):
    per_metre: float  # values a metre
    n: int
    values: np.ndarray  # m, (MOST,)


def build(settings: ErrorTableSettings, dt: float) -> ErrorTableParams:
    """Nothing to discretise: only the position counts."""
    n = len(settings.values)
    values = np.zeros(MOST)
    values[:n] = settings.values
    return ErrorTableParams(n / settings.period, n, values)


@tick
def step(p, x):
    """Corrected position in m for the estimate `x` m."""
    at = x * p.per_metre
    i = floor(at)
    share = at - i
    a = int(i) % p.n
    b = a + 1 if a + 1 < p.n else 0
    return x + (1.0 - share) * p.values[a] + share * p.values[b]
