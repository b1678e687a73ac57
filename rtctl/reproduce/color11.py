"""Chapter 11, colour difference of a grey image by the position error, before and after each correction.

Includes the coherence of error and colour at the three wavelengths.
"""

from functools import cache
from typing import Any

import numpy as np

from rtctl.config.load import set_paths
from rtctl.design import error_table
from rtctl.identify import bench, color, luminance, scale_error
from rtctl.identify.color import Colors
from rtctl.reproduce import chapter11 as ch
from rtctl.reproduce import figures as fig
from rtctl.reproduce.played import config
from rtctl.reproduce.rows import Part, Picture, Row, under

PRINTS = 12  # images for the coherence, with independent ink, paper and scanner
LINES = {"capstan": 18.75e-3, "150": 150e-3, "300": 300e-3}  # m, bins of the thesis
NAMES = {"capstan": "18.75", "150": "150", "300": "300"}
FAR = (25e-3, 120e-3)  # m, range without a line of the error
DEVIATION = "The color spectrum of this print shows large deviation and a periodic pattern in this error"
CLEARLY = "This figure clearly shows the effect of the mechanical errors"
NO_EFFECT = "have no effect on the position error"
REDUCED = "these errors could be reduced"
INKS = "four inks, their places and the coverage chosen here"
SET = f"{ch.PRINTER}, print heads, {INKS}"

COLOR = under(
    Row("11.color_before", "colour difference dE of the grey image, root of the mean square", "10", None, "",
        bound="at least", expected=0.3, quote=DEVIATION,
        remark="no number in the text; a dE of 1 is just visible. Error of the measurement alone, as in section 11.2"),
    Row("11.color_table", "colour difference with an error table from the scale, over the difference without",
        "11.3, (11.12)", None, "",
        bound="at most", expected=0.5, quote=REDUCED,
        remark="no number in the text; the waves of the guide and dirt remain"),
    Row("11.color_direct", "colour difference with direct measurement, over the difference without", "11.3", None, "",
        bound="at most",
        expected=0.2, quote=NO_EFFECT, law=ch.PRESENT_LAW + ", feedback by the scale",
        remark="no number in the text; the counts of the scale, 0.5 um, remain"),
    Row("11.turn_direct", "tracking error that repeats with the turn, with direct measurement", "11.3", None, "um",
        bound="at most", expected=1.0, quote=NO_EFFECT, law=ch.PRESENT_LAW + ", feedback by the scale, shaper 60 rad/s",
        remark="no number in the text; after 20 turns of the capstan"),
    Row("11.turn_repetitive", "tracking error that repeats with the turn, with repetitive control over without", "11.3",
        None, "",
        bound="at most", expected=1.0, quote=REDUCED,
        law=ch.PRESENT_LAW + ", feedback by the scale, shaper 60 rad/s, repetitive control",
        differs="no error that repeats with the turn remains. The law learns errors at the start of the pass, while "
                "the integral settles, and they disturb it afterwards. The loop on the encoder does not measure the "
                "error of the turn",
        remark="no number in the text"),
    *(
        Row(f"11.coherence_{name}", f"coherence of error and luminance at {words} mm", "11.2, figure 11.9", None, "",
            bound="at least", expected=0.5, quote=CLEARLY,
            remark=f"no number in the text; its abstract has a large coherence at three wavelengths. {PRINTS} prints")
        for name, words in NAMES.items()
    ),
    Row("11.coherence_else", "median of the coherence from 25 to 120 mm, where no line is", "11.2, figure 11.9", None,
        "",
        bound="at most", expected=0.3, quote=CLEARLY, remark="no number in the text; noise alone gives 1 / prints"),
    law=ch.PRESENT_LAW, set=SET, filter=ch.VELOCITY,
)  # fmt: skip
BANDWIDTH = 60.0  # rad/s, bandwidth of the shaper
LEARNS = 2400.0  # V/m, learning gain per turn of each section of a turn: less than half of the law's gain
LATE = 0.67  # share of the pass after which 20 turns are learned
WAYS: dict[str, dict[str, Any]] = {"before": {}, "direct": {"sensors.feedback": "scale"}}


@cache
def way(which: str) -> tuple[np.ndarray, np.ndarray]:
    """Target positions (n,) and measurement errors of the loop there (n,), both in m, filtered as in 11.2.

    The tracking error is left out: it differs between a pass and printing steps.
    """
    changes = WAYS.get(which)
    if changes is None:
        changes = {"sensors.correction": {"period": ch.TURN, "values": list(table())}}
    made = scale_error.scale_config(set_paths(config("ldu_printer"), changes), ch.TRAVEL, ch.SPEEDS[0])
    record = bench.play(made)
    (one,) = scale_error.passes(record)
    t, ref, off = record.t, record["ref"], record["truth_x"] - record["position"]
    inside = (ref > one.start) & (ref < one.start + ch.LENGTH) & (np.gradient(ref, t) > 0.5 * ch.SPEEDS[0])
    every = max(1, round(1.0 / (scale_error.RATE * float(t[1] - t[0]))))
    e = smooth(off[inside], float(t[1] - t[0]))[::every]
    return ref[inside][::every], e - e[0]


def smooth(e: np.ndarray, dt: float) -> np.ndarray:
    """Error (n,) after a second-order Butterworth filter of 50 Hz, forwards and backwards."""
    from scipy.signal import butter, sosfiltfilt

    return np.asarray(sosfiltfilt(butter(2, scale_error.CUTOFF, fs=1.0 / dt, output="sos"), e))


@cache
def comes_back(repetitive: bool) -> float:
    """Amplitude in m of the tracking error with one period per turn, in the last third of a pass; direct feedback."""
    speed = ch.SPEEDS[0]
    made = scale_error.scale_config(config("ldu_printer"), ch.TRAVEL, speed)
    made = set_paths(made, {"sensors.feedback": "scale", "law.shaper.bandwidth": BANDWIDTH})
    if repetitive:
        law = {"period": ch.TURN, "gain": LEARNS * speed / ch.TURN, "slow": 0.3 * speed}
        made = set_paths(made, {"law.compensation.repetitive": law})
    record = bench.play(made)
    (one,) = scale_error.passes(record)
    x = record["ref"]
    late = (x > one.start + LATE * ch.LENGTH) & (x < one.start + ch.LENGTH)
    at, e = x[late], (x - record["truth_x"])[late]
    e = e - np.polyval(np.polyfit(at - one.start, e, 2), at - one.start)  # the integrator is not settled yet
    return float(np.sqrt(2)) * error_table.periodic(at, e, ch.TURN, harmonics=1)


@cache
def table() -> tuple[float, ...]:
    """Error table (n,) in m from the scale."""
    x, e = ch.left((0.0, 0.0), ch.SPEEDS[0])
    return tuple(error_table.from_scale(x, e, ch.TURN).settings.values)


@cache
def image(which: str) -> Colors:
    """Colours of the grey image of a pass."""
    return color.printed(*way(which))


@cache
def coherence() -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths (k,) in m and coherence (k,) of error and luminance, over prints of one pass."""
    one = ch.printer(ch.SPEEDS[0])
    at = np.linspace(0.0, ch.LENGTH, ch.N, endpoint=False)
    images = []
    for seed in range(1, PRINTS + 1):
        made = luminance.printed(one.x, one.e, luminance.PrintSettings(seed=seed))
        images.append(np.interp(at, made.x - made.x[0], made.L))
    e = np.interp(at, one.x - one.x[0], one.e)
    return color.coherence([e] * PRINTS, images, at, ch.N)


def colors(short: bool) -> dict[str, float]:
    """Rows of colour differences and coherence."""
    before = image("before").rms
    length, C = coherence()
    at = {f"11.coherence_{name}": float(C[np.argmin(np.abs(length - line))]) for name, line in LINES.items()}
    return {
        "11.color_before": before,
        "11.color_table": image("table").rms / before,
        "11.color_direct": image("direct").rms / before,
        "11.turn_direct": 1e6 * comes_back(False),
        "11.turn_repetitive": comes_back(True) / comes_back(False),
        **at,
        "11.coherence_else": float(np.median(C[(length > FAR[0]) & (length < FAR[1])])),
    }


def figure_11_11(short: bool) -> Picture:
    """Figure of the colour difference over position, and of the coherence over wavelength."""
    figure, (E, C) = fig.panels(2, height=1.9)
    for which, shade in (("before", fig.BLUE), ("table", fig.GREEN), ("direct", fig.ORANGE)):
        found = image(which)
        fig.line(E, 1e3 * found.x, found.dE, shade, linewidth=0.8, label=which)
    E.set(xlabel="position [mm]", ylabel="dE")
    fig.legend(E, ncols=3)
    length, value = coherence()
    C.semilogx(1e3 * length, value, color=fig.BLUE, linewidth=0.7)
    for line in LINES.values():
        C.axvline(1e3 * line, color=fig.GREY, linewidth=0.6, linestyle=":")
    C.set(xlabel="wavelength [mm]", ylabel="coherence", ylim=(0, 1.05))
    got = colors(short)
    sentence = (
        f"Not in the text: CIE 1976 colour difference of a grey image ({INKS}): {got['11.color_before']:.2f} for the "
        f"printer as it is, {got['11.color_table']:.2f} of this with an error table and {got['11.color_direct']:.2f} "
        f"with direct measurement. Below: the coherence of position error and luminance over {PRINTS} prints."
    )
    return Picture("11.11", sentence, figure)


PART = Part("colour", COLOR, colors, {"11.11": figure_11_11})
