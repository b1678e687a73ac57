"""Chapter 9, recommended for the reel unit: a gain that follows the reel radii."""

from functools import cache

import numpy as np

from rtctl.design import schedule
from rtctl.identify import bench, steps
from rtctl.reproduce.played import reels
from rtctl.reproduce.rows import Part, Row

FULL = (0.04, 0.04)  # m, where a fixed gain is nearest to its limit

SCHEDULE = (
    Row("9.gain_margin_fixed", "least gain margin over the radii, fixed gain", "5.2, 8.2", 6.0, "dB", 0.1,
        relative=False, erratum="robust for all radii in the text; the equations leave 1.2 dB at 40/40 mm",
        expected=1.2),
    Row("9.gain_margin", "least gain margin over the radii, gain scheduled", "9, 8.2", 6.0, "dB", bound="at least"),
    Row("9.accuracy", "accuracy of steps at 40/40 mm with it", "9, 8.3", 0.1, "mm", bound="at most"),
)  # fmt: skip


@cache
def designed() -> schedule.Schedule:
    """A table of factors that keeps 6 dB and 45 deg on the loop as it is printed."""
    return schedule.design(reels(*FULL), GM=6.0, printed=True)


def scheduled(short: bool) -> dict[str, float]:
    """Margins without and with the schedule, and a step with it on the emulator."""
    found = designed()
    made = steps.radian_config(schedule.with_table(reels(*FULL), found.table), R1=FULL[0], R2=FULL[1])
    done = steps.steps(bench.play(made))
    return {
        "9.gain_margin_fixed": found.fixed.worst[0],
        "9.gain_margin": float(np.min(found.scheduled.GM)),
        "9.accuracy": abs(done.worst_mm),
    }


PARTS = (Part("gain schedule", SCHEDULE, scheduled),)
