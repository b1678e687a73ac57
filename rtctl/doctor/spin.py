"""Advice on `loop.spin`: to poll the clock at the end of each sleep, where a CPU can be spared for it.

A sleeping loop is as late as its wake-up by the kernel. With `loop.spin` the loop is woken earlier by that time and
polls the clock; it is late only where its wake-up is later than that. The polling takes a share of its CPU.
"""

import math
from typing import NamedTuple

from rtctl.doctor.finding import Finding
from rtctl.doctor.measure import Rate, words

STEP = 10e-6  # s, step of the advised spin
LEAST = 5e-6  # s, lateness at p99 below which no spin is advised
MOST_SHARE = 0.8  # largest share of a CPU for polling; the tick needs the other part
LIMIT = 1e-3  # s, upper bound of the setting loop.spin


class Spin(NamedTuple):
    """Advice for one rate."""

    hz: float
    seconds: float  # loop.spin
    share: float  # of a CPU, for polling
    sentence: str


def advice(findings: list[Finding], rates: list[Rate]) -> Spin | None:
    """Advice for the highest measured rate; None where no CPU can be spared, or where wake-ups are early enough."""
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
