"""Chapter 12 with print heads: figures 12.5, 12.8 and 12.9 on a linear drive with the resonances of the thesis."""

from functools import cache
from typing import Any

import numpy as np

from rtctl.design import check, shaping
from rtctl.identify import best_linear, experiment
from rtctl.identify.records import take
from rtctl.loop import fused
from rtctl.reproduce import chapter12 as ch
from rtctl.reproduce import figures as fig
from rtctl.reproduce.played import config
from rtctl.reproduce.rows import Part, Picture, Row, under

BAND = (50.0, 220.0)  # Hz, range of the resonances in the thesis
STANDS = 1.0  # dB, least prominence of a peak of the response on both sides
CHOSEN = "frequencies, masses and damping of four print heads; the text has none"
SET = "figure_12_2, the print heads of ldu_printer"
SEVERAL = "From 50 to 220 [Hz] the FRF shows several damped resonances"
MADE = "lead-lag, notches and low-pass, made for this machine"
KEPT = "lead-lag, notch and low-pass, made for the machine without heads"

HEADS = under(
    Row("12.heads_seen", "resonances from 50 to 220 Hz that the measured response shows", "12.3, figure 12.5", None, "",
        bound="at least", expected=3.0, quote=SEVERAL, law=ch.MEASURING, filter="derivative 1000 Hz", chosen=CHOSEN,
        remark="no number in the text: several"),
    Row("12.heads_present_bandwidth", "bandwidth of the running present loop", "12.7, figure 12.8", 8.0, "Hz",
        0.06, quote="The system bandwidth is approximately 8 [Hz]", law=ch.PRESENT_LAW, filter="velocity 200 Hz",
        chosen=ch.PRESENT_GAINS),
    Row("12.heads_present_margin", "its gain margin", "12.7, figure 12.8", 2.0, "dB", 0.5, relative=False,
        quote="The obtained gain margin is only 2 [dB]", law=ch.PRESENT_LAW, filter="velocity 200 Hz",
        differs="8 dB: the heads damp the mode of the carriage at 114 Hz, which leaves a margin of 2 dB without heads"),
    Row("12.heads_kept_margin", "gain margin of filters designed without the heads", "12.7, figure 12.9",
        11.0, "dB", bound="at least", quote=ch.WITH_NOTCHES, law=KEPT,
        differs="8 dB, and stable: filters have to be designed on the response of their own machine"),
    Row("12.heads_bandwidth", "bandwidth of filters designed on the response with the heads", "12.7, figure 12.9", 50.0,
        "Hz", bound="at least", quote="a closed loop bandwidth of 50 [Hz] can be easily obtained", law=MADE,
        remark="the largest bandwidth with 11 dB and 60 deg; the text has 52 Hz"),
    Row("12.heads_gain_margin", "their gain margin", "12.7, figure 12.9", 11.0, "dB", bound="at least",
        quote=ch.WITH_NOTCHES, law=MADE, chosen=ch.LIMITS),
    Row("12.heads_phase_margin", "their phase margin", "12.7, figure 12.9", 60.0, "deg", bound="at least",
        quote=ch.WITH_NOTCHES, law=MADE, chosen=ch.LIMITS),
    Row("12.heads_notches", "notches with the heads that reduce the gain by 3 dB or more", "12.7, figure 12.9", 2.0, "",
        quote="a bode plot of a lead-lag controller with two notches", law=MADE,
        differs="one notch, of 8 dB at 81 Hz, is enough with the heads chosen here"),
    set=SET, filter="low-pass 2 kHz",
)  # fmt: skip


@cache
def machine() -> Any:
    """Config of the linear drive with the printer's print heads, without its other errors."""
    heads = [entry.model_dump() for entry in config("ldu_printer").plant.physics if entry.term == "structure.resonance"]
    return config("ldu", {"plant.physics": heads})


@cache
def response_of() -> best_linear.BestLinear:
    """Best linear approximation of the linear drive with print heads."""
    played = experiment.multisine(machine(), realisations=2, periods=2)
    return best_linear.identify([take(fused.run(one.config, one.seconds)) for one in played])


@cache
def shaped() -> shaping.Shaped:
    """Optimised filters for the response with print heads."""
    frf = response_of().frf
    return shaping.of_points(frf.f, frf.H, frf.dt, None)


@cache
def running(which: str) -> check.Measured:
    """Measured loop gain: `present`, `kept` (filters designed without the heads) or `made` (designed with them)."""
    made = machine()
    if which != "present":
        made = shaping.applied(made, (ch.shaped() if which == "kept" else shaped()).law)
    return check.measure(made, rms=ch.RMS["present" if which == "present" else "shaped"], f_max=ch.TOP)


def peaks(f: np.ndarray, H: np.ndarray) -> list[float]:
    """Frequencies in Hz of the peaks of |H| f^2 in `BAND`: resonances above the mass line of the drive."""
    from scipy.signal import find_peaks

    inside = (f >= BAND[0]) & (f <= BAND[1])
    level = fig.db(H[inside] * f[inside] ** 2)
    smooth = np.convolve(level, np.ones(5) / 5, mode="same")
    found, _ = find_peaks(smooth, prominence=STANDS)
    return [float(x) for x in f[inside][found]]


def with_heads(short: bool) -> dict[str, float]:
    """Rows of the machine with print heads."""
    best, present, kept = (
        response_of(), running("present").margins, running("kept").margins
    )  # fmt: skip
    made = shaped()
    return {
        "12.heads_seen": len(peaks(best.f, best.G)),
        "12.heads_present_bandwidth": present.bandwidth,
        "12.heads_present_margin": present.GM,
        "12.heads_kept_margin": kept.GM,
        "12.heads_bandwidth": made.margins.bandwidth,
        "12.heads_gain_margin": made.margins.GM,
        "12.heads_phase_margin": made.margins.PM,
        "12.heads_notches": sum(depth >= ch.ACTS for depth in ch.depths(made)),
    }


def figure_12_11(short: bool) -> Picture:
    """Figure of response and loops with and without print heads."""
    figure, (H, opened, closed, S) = fig.panels(2, 2)
    for best, color, words in ((ch.response_of(), fig.GREY, "without"), (response_of(), fig.BLUE, "with heads")):
        H.semilogx(best.f, fig.db(best.G * best.f**2), color=color, linewidth=0.9, label=words)
    H.set(xlim=(10, 300), ylabel="gain times f^2 [dB]")
    fig.legend(H)
    for which, color in (("present", fig.BLUE), ("kept", fig.GREEN), ("made", fig.ORANGE)):
        got = running(which)
        opened.semilogx(got.f, fig.db(got.L), color=color, linewidth=0.9, label=which)
        closed.semilogx(got.f, fig.db(got.L / (1 + got.L)), color=color, linewidth=0.9)
        S.semilogx(got.f, fig.db(1 / (1 + got.L)), color=color, linewidth=0.9)
    for axes, words in ((opened, "|L| [dB]"), (closed, "|L / (1 + L)| [dB]"), (S, "|S| [dB]")):
        axes.set(ylabel=words, xlabel="frequency [Hz]")
    fig.legend(opened)
    value = with_heads(short)
    sentence = (
        "Figures 12.5, 12.8 and 12.9 with the print heads of ldu_printer, chosen here: the response by a multisine, "
        "and the running loops: the present controller, the filters designed without the heads "
        f"({value['12.heads_kept_margin']:.1f} dB of gain margin), and the filters designed with the heads "
        f"({value['12.heads_bandwidth']:.0f} Hz at {value['12.heads_gain_margin']:.0f} dB and "
        f"{value['12.heads_phase_margin']:.0f} deg)."
    )
    return Picture("12.11", sentence, figure)


PART = Part("print heads", HEADS, with_heads, {"12.11": figure_12_11})
