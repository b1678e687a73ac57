"""What `loop.spin` would bring: the end of each sleep spent polling the clock, where a CPU can be spared for it.

A loop that sleeps wakes as late as the kernel wakes it. One that is woken earlier by `loop.spin` and polls the clock is
late only where it was woken later than that. The price is that share of its CPU.
"""

import math
from typing import NamedTuple

from rtctl.doctor.finding import Finding
from rtctl.doctor.measure import Rate, words

STEP = 10e-6  # s: spin is advised in steps of this
LEAST = 5e-6  # s of lateness at p99, below which it brings nothing
MOST_SHARE = 0.8  # of a CPU: a loop that polls more has no time for its tick
LIMIT = 1e-3  # s, of the setting


class Spin(NamedTuple):
    """An advice for one rate."""

    hz: float
    seconds: float  # loop.spin
    share: float  # of a CPU that it takes
    sentence: str


def advice(findings: list[Finding], rates: list[Rate]) -> Spin | None:
    """For the fastest rate that was measured: None where no CPU can be spared, or where wake-ups are early enough."""
    spare = next((f.verdict == "good" for f in findings if f.name == "CPUs"), False)
    rate = max(rates, key=lambda r: r.hz, default=None)
    if rate is None or not spare or rate.ours.us["p99"] * 1e-6 < LEAST:
        return None
    seconds = STEP * math.ceil(rate.ours.us["p999"] * 1e-6 / STEP)
    seconds = min(seconds, STEP * math.floor(MOST_SHARE / rate.hz / STEP), LIMIT)
    if seconds <= 0.0:
        return None
    share = seconds * rate.hz
    told = (
        f"At {words(rate.hz)} half of the wake-ups are {rate.ours.us['p50']:.1f} us late and 1 % are later than "
        f"{rate.ours.us['p99']:.1f} us. If {100 * share:.0f} % of a CPU can be spared: "
        f"--set loop.spin={seconds * 1e6:.0f}us polls the clock for that long before each tick."
    )
    return Spin(rate.hz, seconds, share, told)
