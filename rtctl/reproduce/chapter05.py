"""Chapter 5, controller design on the simulation set: tension, reel radii, PD by bandwidth and damping (figure 5.2)."""

from functools import cache
from typing import NamedTuple

import numpy as np

from rtctl.design import margins, response
from rtctl.identify import best_linear, experiment
from rtctl.identify import reel_radius as rr
from rtctl.identify.records import take
from rtctl.laws import pd
from rtctl.loop import fused
from rtctl.plants import ivu
from rtctl.reproduce import figures as fig
from rtctl.reproduce.played import play, reels
from rtctl.reproduce.rows import Part, Picture, Row

K_P, W_N = 31.6, 2 * np.pi  # rad/s^2/A and rad/s, of section 5.2
AMPERE_PER_VOLT = 0.2
HEAVY = 1.5e-3  # kg m^2, the identified J_m, with which K_p is the 31.6 of the text
REELS = ((0.04, 0.02), (0.03, 0.03), (0.02, 0.04))  # m
CORNERS = ((0.04, 0.02), (0.02, 0.04), (0.04, 0.04), (0.02, 0.02))  # m

TENSION = (
    Row("5.tension_torque", "torque for a tension of 0.1 N at R = 30 mm", "(5.1)", 3.0, "mNm", 0.02,
        remark="what board and driver make of it: 12 bits of the output are 0.06 mNm"),
)  # fmt: skip
RADII = (
    Row("5.accuracy_reel", "accuracy of a reel's 209 increments over 0.6 rad", "(5.3)", 5.0, "%", 0.02),
    Row("5.travel", "paper moved for 5 % at the largest reel", "(5.3)", 24.0, "mm", 0.02),
    Row("5.travel_capstan", "turn of the capstan for it", "(5.3)", 1.9, "rad", 0.02),
    Row("5.accuracy_capstan", "accuracy of the capstan's 500 increments over that", "(5.3)", 0.7, "%", 0.06,
        remark="the text rounds 0.66"),
    Row("5.radius_error", "largest error of (5.2) over 1.9 rad, reels of 20 to 40 mm", "(5.2), (5.3)", 5.0, "%",
        bound="at most"),
    Row("5.radius_error_edges", "the same between edges of the reel sensors", "(5.2)", 5.0, "%", bound="at most",
        remark="what the machine does at arming: two edges are known to a tick"),
)  # fmt: skip
DESIGN = (
    Row("5.process_gain", "K_p of the simulation set at 20/20 mm", "5.2", 31.6, "rad/s^2/A", 0.03,
        erratum="64 with the listed J_m = 7.5e-4 kg m^2, a factor of 2", expected=64.0),
    Row("5.process_gain_heavy", "the same with the identified J_m = 1.5e-3 kg m^2", "5.2", 31.6, "rad/s^2/A", 0.03),
    Row("5.gain", "G for K_p = 31.6, 2 pi rad/s, zeta = 1", "(5.4)", 1.25, "A/rad", 0.01),
    Row("5.tau_d", "derivative time for it", "(5.4)", 0.32, "s", 0.01),
    Row("5.bandwidth_low", "lowest bandwidth over the radii, |T| = 0 dB", "5.2, figure 5.2", 1.0, "Hz", 0.5,
        relative=False, remark="with J_m = 1.5e-3, for which K_p is 31.6; the text prints whole hertz"),
    Row("5.bandwidth_high", "highest bandwidth over the radii, |T| = 0 dB", "5.2, figure 5.2", 2.0, "Hz", 0.5,
        relative=False, remark="with J_m = 1.5e-3, for which K_p is 31.6; the text prints whole hertz"),
    Row("5.phase_margin_full", "phase margin at 40/20 mm", "5.2, figure 5.2", 88.0, "deg", 3.0, relative=False,
        remark="with J_m = 1.5e-3, for which K_p is 31.6"),
    Row("5.phase_margin_empty", "phase margin at 20/40 mm", "5.2, figure 5.2", 75.0, "deg", 2.0, relative=False,
        erratum="the equations give 56 deg at 20/40 mm; 76 deg is that of 20/20 mm (next row)", expected=56.0),
    Row("5.phase_margin_both_empty", "phase margin at 20/20 mm", "5.2, figure 5.2", 75.0, "deg", 2.0, relative=False),
)  # fmt: skip


def tension(short: bool) -> dict[str, float]:
    """Volts that the machine writes at rest, as a torque."""
    made = reels(0.03, 0.03, {"law.friction": {"motor1": {"tau_C": 0.0}, "motor2": {"tau_C": 0.0}}})
    run = play(made, 2.0)
    torque = ivu.parameters(made.plant).K_m1 * AMPERE_PER_VOLT * float(run["u1"][-200:].mean())
    return {"5.tension_torque": 1e3 * torque}


def radii(short: bool) -> dict[str, float]:
    """(5.3) for the numbers of the text, (5.2) on the emulator."""
    off, between = [], []
    for R1, R2 in REELS:
        record = take(play(rr.radius_config(reels(R1, R2), travel=1.9 + 2 * rr.RUN_IN + 0.05), 12.0))
        for way in rr.reel_radii(record, 1.9):
            inside = (record.t >= way.begin) & (record.t <= way.end)
            for one, name in ((way.R1, "truth_R1"), (way.R2, "truth_R2")):
                R = record[name][inside].mean()
                off.append(abs(one.plain / R - 1))
                between.append(abs(one.R / R - 1))
    return {
        "5.accuracy_reel": 100 * rr.accuracy(209, 0.6),
        "5.travel": 1e3 * rr.travel_for(0.05) * 0.0125,
        "5.travel_capstan": rr.travel_for(0.05),
        "5.accuracy_capstan": 100 * rr.accuracy(500, 1.9),
        "5.radius_error": 100 * max(off),
        "5.radius_error_edges": 100 * max(between),
    }


def process_gain(J_m: float, short: bool) -> float:
    """K_p at 1 Hz in rad/s^2/A of the simulation set at 20/20 mm, by a multisine on the emulator."""
    changes = {"plant.parameters": {"J_m1": J_m, "J_m2": J_m, "d_tape": 0.0}, "radius.d_tape": 0.0}
    made = reels(0.02, 0.02, {"plant.set": "simulation", **changes})
    played = experiment.multisine(made, rms=0.3, realisations=2 if short else 4)
    found = best_linear.identify([take(fused.run(one.config, one.seconds)) for one in played])
    return float(abs(found.frf.without_drive(made).at(1.0))) * (2 * np.pi) ** 2


class Corner(NamedTuple):
    """The loop of (5.4) without delay, at a pair of radii."""

    L: margins.Response
    margins: margins.Margins
    bandwidth: float  # Hz, where |T| falls through 0 dB


@cache
def corner(R1: float, R2: float) -> Corner:
    """The PD of section 5.2 on the simulation set, with the J_m for which its K_p holds."""
    G, tau_d = pd.design(K_P, W_N)
    model = response.take(reels(R1, R2, {"plant.set": "simulation", "plant.parameters.J_m1": HEAVY,
                                         "plant.parameters.J_m2": HEAVY})).model  # fmt: skip

    def L(f: np.ndarray) -> np.ndarray:
        return response.plant_response(model, f) * G / AMPERE_PER_VOLT * (1 + 2j * np.pi * f * tau_d)

    f = np.geomspace(0.02, 50.0, 3000)
    T = np.abs(L(f) / (1 + L(f)))
    through = np.flatnonzero((T[:-1] >= 1) & (T[1:] < 1))
    return Corner(L, margins.margins(L, 0.02, 400.0), float(f[through[0]]))


def design(short: bool) -> dict[str, float]:
    """K_p as it is measured, PD by (5.4), and the loop over the radii."""
    G, tau_d = pd.design(K_P, W_N)
    widths = [corner(*R).bandwidth for R in CORNERS]
    return {
        "5.process_gain": process_gain(7.5e-4, short),
        "5.process_gain_heavy": process_gain(HEAVY, short),
        "5.gain": G,
        "5.tau_d": tau_d,
        "5.bandwidth_low": min(widths),
        "5.bandwidth_high": max(widths),
        "5.phase_margin_full": corner(0.04, 0.02).margins.PM,
        "5.phase_margin_empty": corner(0.02, 0.04).margins.PM,
        "5.phase_margin_both_empty": corner(0.02, 0.02).margins.PM,
    }


def figure_5_2(short: bool) -> Picture:
    """Closed-loop response and Nyquist plot at the corners of the radii."""
    figure, (closed, nyquist) = fig.panels(1, 2, height=3.0)
    f = np.geomspace(0.05, 50.0, 600)
    for (R1, R2), color in zip(CORNERS, fig.COLORS, strict=True):
        L = corner(R1, R2).L(f)
        closed.semilogx(f, fig.db(L / (1 + L)), color=color, linewidth=1.1, label=f"{1e3 * R1:g}/{1e3 * R2:g} mm")
        nyquist.plot(L.real, L.imag, color=color, linewidth=1.1)
    turn = np.linspace(0, 2 * np.pi, 200)
    nyquist.plot(np.cos(turn), np.sin(turn), ":", color=fig.GREY, linewidth=0.8)
    nyquist.plot([-1], [0], "+", color=fig.RED)
    nyquist.set(xlim=(-3, 1.5), ylim=(-3, 1.5), aspect="equal", xlabel="real part of L", ylabel="imaginary part of L")
    closed.set(xlabel="frequency [Hz]", ylabel="|T| [dB]", ylim=(-40, 10))
    fig.legend(closed)
    widths = [corner(*R).bandwidth for R in CORNERS]
    sentence = (
        "The PD of (5.4) on the simulation set without delay, with the J_m for which K_p is 31.6: |T| falls "
        f"through 0 dB at {min(widths):.1f} to {max(widths):.1f} Hz, depending on the radii."
    )
    return Picture("5.2", sentence, figure)


PARTS = (
    Part("tension feedforward", TENSION, tension),
    Part("reel radii", RADII, radii),
    Part("PD by bandwidth and damping", DESIGN, design, {"5.2": figure_5_2}),
)
