"""Chapter 10: the linear drive prints in steps of 1/12 and 1/24 mm."""

import numpy as np

from rtctl.identify import bench, steps
from rtctl.reproduce.played import config
from rtctl.reproduce.rows import Part, Row, under

PRESENT_LAW = "present controller, gains chosen here: 6400 V/m, 4 s, 172 Vs/m"  # gains of the shipped config
SIZES = {"10.step_twelfth": steps.TWELFTH, "10.step_twenty_fourth": steps.TWENTY_FOURTH}

STEPS = under(
    *(
        Row(name, f"mean of the steps of {words} mm, by the linear scale", "10", value, "um", 0.03,
            quote="It steps during printing with a step size of 1/12 or 1/24 [mm]",
            remark="a pitch of the scale is 0.5 um, a count of the encoder 0.9 um")
        for (name, words, value) in (("10.step_twelfth", "1/12", 83.33), ("10.step_twenty_fourth", "1/24", 41.67))
    ),
    law=PRESENT_LAW + ", shaper 60 rad/s", set="figure_12_2", filter="velocity 200 Hz",
)  # fmt: skip


def stepping(short: bool) -> dict[str, float]:
    """Rows of the printing steps of the shipped linear drive, forward and back."""
    values = {}
    for name, size in SIZES.items():
        done = steps.steps(bench.play(steps.printing_config(config("ldu"), size, 6 if short else 24)), "scale")
        sizes = np.array([step["size"] for step in done.each], float) * done.mm
        errors = np.array([step["final_error_mm"] for step in done.each], float)
        way = sizes - np.diff(errors, prepend=0.0)
        values[name] = 1e3 * float(np.mean(np.abs(way)))
    return values


PARTS = (Part("printing steps", STEPS, stepping),)
