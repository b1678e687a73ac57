"""Chapter 6, simulation: motors without a loop (figure 6.1), radii at arming, a move in closed loop (figure 6.2)."""

from functools import cache
from typing import Any

import numpy as np

from rtctl.laws import pd
from rtctl.loop.fused import Run
from rtctl.plants import ivu
from rtctl.reproduce import figures as fig
from rtctl.reproduce.chapter04 import R_C
from rtctl.reproduce.chapter05 import AMPERE_PER_VOLT, K_P, W_N
from rtctl.reproduce.played import play, reels
from rtctl.reproduce.rows import Part, Picture, Row, under

NO_GAIN = 1e-6  # V/rad, too small for an effect of the position: the reference sets the voltage
KICK = 0.1  # V, added to one motor
UP, DOWN, SECOND = 2.0, 4.0, 1.0  # s: start of the added voltage on motor 2, on motor 1, and its duration
MOVE = 8.0  # rad of the capstan, 0.1 m
SPEED = 1.6  # rad/s, 0.02 m/s (3)
BARE = {"law.shaper": {}, "law.inertia": {}, "safety.following_error": 0, "safety.current_time": 0}

COUNTS = {500: {"lines": 125}, 10000: {"lines": 2500}}  # increments a turn: four for each line of the disc
WINDOW = 0.5  # mm, margin of the camera (3)
OVERDAMPED = "the closed loop behavior is stable and the system is overdamped"
TENSION = "The tension force is kept at the desired level during constant velocity"
NOISY = "500 increments make the derivative noisy; the motors pull in turn, and the mean tension rises"

OPEN = under(
    Row("6.deflection", "end deflection of reel 1 at 0.049 A, R = 30 mm", "6.1, figure 6.1(c)", 6.8e-2, "rad", 0.03,
        quote=r"= 6.8 \cdot 10^{-2}$  [rad]", erratum="I K_m / (c R^2) is 3.3e-2 rad", expected=3.3e-2),
    Row("6.tension", "tension at constant velocity", "6.1, figure 6.1(b)", 0.1, "N", 0.03,
        quote="but remains at the desired level during constant velocity"),
    law="currents, no loop", set="simulation, tau_F = 0",
)  # fmt: skip
RADIUS = under(
    Row("6.radius_error", "largest error of the radii measured at arming", "6.2", 5.0, "%", bound="at most",
        quote="the system is triggered and the reel radii are estimated",
        remark="section 5.1 asks for 5 %; 10000 counts of the capstan in place of 500"),
    law="arming: motor 2 pulls, motor 1 holds the tape", set="identified",
)  # fmt: skip
CLOSED = under(
    Row("6.overshoot", "overshoot of a move of 0.1 m, 500 increments, 20/40 mm", "6.3, figure 6.2", 0.0, "mm", WINDOW,
        relative=False, quote=OVERDAMPED, set="simulation, 500 increments",
        differs="friction of 1 mNm is compensated in full and does not damp; " + NOISY,
        remark="the tolerance is the margin of the camera, chapter 3"),
    Row("6.overshoot_10000", "the same with 10000 counts", "6.3, figure 6.2", 0.0, "mm", WINDOW, relative=False,
        quote=OVERDAMPED, set="simulation, 10000 counts",
        differs="friction of 1 mNm is compensated in full and does not damp"),
    Row("6.overshoot_uncompensated", "overshoot of a move of 0.1 m, 10000 counts, friction not compensated",
        "6.3, figure 6.2", 0.0,
        "mm", WINDOW, relative=False, quote="is reduced by the Coulomb friction", set="simulation, 10000 counts",
        law="PD (5.4), no friction feedforward",
        chosen="no friction feedforward, and 10000 counts in place of 500"),
    Row("6.tension_moving", "tension at constant velocity in closed loop, 500 increments", "6.3, figure 6.2(d)", 0.1,
        "N", 0.05, quote=TENSION, set="simulation, 500 increments", differs=NOISY),
    Row("6.tension_moving_10000", "the same with 10000 counts", "6.3, figure 6.2(d)", 0.1, "N", 0.05, quote=TENSION,
        set="simulation, 10000 counts", chosen="10000 counts of the prototype in place of 500"),
    law="PD (5.4), G = 1.25 A/rad, friction feedforward 1 mNm", filter="derivative 20 Hz, not in the text",
)  # fmt: skip


@cache
def without_loop() -> Run:
    """Run of figure 6.1: tension from the start, KICK on motor 2 for a second, then on motor 1; without friction."""
    steps = [(UP, -KICK), (UP + SECOND, 0.0), (DOWN, KICK), (DOWN + SECOND, 0.0)]
    changes: dict[str, Any] = {
        **BARE,
        "plant.set": "simulation",
        "plant.parameters.tau_F1": 0.0,
        "plant.parameters.tau_F2": 0.0,
        "law.position": {"gain": NO_GAIN, "tau_d": 0.0},
        "law.friction": {"motor1": {"tau_C": 0.0}, "motor2": {"tau_C": 0.0}},
        "law.tension": {"F_t": 0.1, "ramp": 0.0},
        "reference": {"steps": [{"at": t, "to": volts / NO_GAIN} for t, volts in steps]},
    }
    return play(reels(0.03, 0.03, changes), 7.0)


def open_loop(short: bool) -> dict[str, float]:
    """Rows of the deflection before the step of motor 2, and of the tension before any step."""
    run = without_loop()
    still, moving = run.between(UP - 0.5, UP), run.between(UP + SECOND + 0.7, DOWN)
    return {
        "6.deflection": float(still["truth_motor1"].mean()),
        "6.tension": float(np.mean([moving[f"truth_tension{i}"].mean() for i in (1, 2)])),
    }


def arming(short: bool) -> dict[str, float]:
    """Rows of the radii measured at arming, against the true radii."""
    pairs = ((0.038, 0.022),) if short else ((0.038, 0.022), (0.02, 0.04), (0.04, 0.02), (0.03, 0.03))
    off = []
    for R1, R2 in pairs:
        run = play(reels(R1, R2, {"radius.source": "measured"}), 16.0)
        first = run.between(0.0, 0.1)
        off += [abs(float(first[name][0] / first[f"truth_{name}"][0]) - 1) for name in ("R1", "R2")]
    return {"6.radius_error": 100 * max(off)}


@cache
def move(increments: int = 500, compensated: bool = True) -> Run:
    """Run of figure 6.2: a move of 0.1 m at 0.02 m/s with the PD of (5.4), R1 = 20 and R2 = 40 mm."""
    G, tau_d = pd.design(K_P, W_N)
    tau_C = ivu.parameters(reels(0.02, 0.04, {"plant.set": "simulation"}).plant).tau_F1 if compensated else 0.0
    changes: dict[str, Any] = {
        **BARE,
        "plant.set": "simulation",
        "sensors.capstan": COUNTS[increments],
        "law.position": {"gain": G / AMPERE_PER_VOLT, "tau_d": tau_d, "derivative_filter": 20.0},
        "law.friction": {"motor1": {"tau_C": tau_C}, "motor2": {"tau_C": tau_C}},
        "reference": {"steps": [{"at": 0.5, "to": MOVE, "ramp": SPEED}]},
    }
    made = reels(0.02, 0.04, changes)
    return play(made, 9.5)


def overshoot(run: Run) -> float:
    """Overshoot of the capstan beyond the move, in mm of paper."""
    return 1e3 * R_C * max(float(run["truth_capstan"].max()) - MOVE, 0.0)


def tension_moving(run: Run) -> float:
    """Mean tension in N of both tapes at constant velocity."""
    steady = run.between(2.0, 5.0)
    return float(np.mean([steady[f"truth_tension{i}"].mean() for i in (1, 2)]))


def closed_loop(short: bool) -> dict[str, float]:
    """Rows of overshoot and tension of the move."""
    return {
        "6.overshoot": overshoot(move()),
        "6.overshoot_10000": overshoot(move(10000)),
        "6.overshoot_uncompensated": overshoot(move(10000, compensated=False)),
        "6.tension_moving": tension_moving(move()),
        "6.tension_moving_10000": tension_moving(move(10000)),
    }


def figure_6_1(short: bool) -> Picture:
    """Figure of currents, tensions, reels before two seconds, reels and capstan."""
    run = without_loop()
    rows = run.between(0.0, 6.0)
    t = rows["t"] - run.start
    figure, (volts, force, early, late) = fig.panels(2, 2)
    for i, color, style in ((1, fig.BLUE, "-"), (2, fig.ORANGE, "--")):
        fig.line(volts, t, 1e3 * AMPERE_PER_VOLT * rows[f"u{i}"], color, style, label=f"motor {i}")
        fig.line(force, t, rows[f"truth_tension{i}"], color, style, label=f"tape {i}")
        begin = (run["t"] > run.start - 0.1) & (run["t"] < run.start + UP)
        fig.line(early, run["t"][begin] - run.start, 1e3 * run[f"truth_motor{i}"][begin], color, style)
        fig.line(late, t, rows[f"truth_motor{i}"], color, style, label=f"motor {i}")
    fig.line(late, t, rows["truth_capstan"], fig.GREEN, label="capstan")
    for axes, words in (
        (volts, "current [mA]"),
        (force, "tension [N]"),
        (early, "angle [mrad]"),
        (late, "angle [rad]"),
    ):
        axes.set(xlabel="time [s]", ylabel=words)
    for axes in (volts, force, late):
        fig.legend(axes)
    force.set_ylim(top=0.145)
    fig.legend(force, ncols=2, loc="upper right")
    value = open_loop(short)
    sentence = (
        "Both motors at 0.049 A, then more current for a second at motor 2, and then at motor 1: the reels come to "
        f"rest at {1e3 * value['6.deflection']:.0f} mrad, and the tape moves at constant velocity with "
        f"{value['6.tension']:.3f} N. Simulation set without friction."
    )
    return Picture("6.1", sentence, figure)


def figure_6_2(short: bool) -> Picture:
    """Figure of capstan, motors, tracking error and tension of the move with 10000 counts."""
    run = move(10000)
    rows = run.between(0.0, 8.5)
    t = rows["t"] - run.start
    figure, (angle, motors, error, force) = fig.panels(2, 2)
    fig.line(angle, t, rows["ref"], fig.INK, "--", label="reference")
    fig.line(angle, t, rows["truth_capstan"], fig.BLUE, label="capstan")
    for i, color in ((1, fig.BLUE), (2, fig.ORANGE)):
        fig.line(motors, t, rows[f"truth_motor{i}"], color, label=f"motor {i}")
        fig.line(force, t, rows[f"truth_tension{i}"], color, "-" if i == 1 else "--", label=f"tape {i}")
    fig.line(error, t, 1e3 * rows["capstan_error"], fig.RED)
    words = ((angle, "angle [rad]"), (motors, "angle [rad]"), (error, "error [mrad]"), (force, "tension [N]"))
    for axes, label in words:
        axes.set(xlabel="time [s]", ylabel=label)
    for axes in (angle, motors, force):
        fig.legend(axes)
    force.set_ylim(bottom=0.0)
    value = closed_loop(short)
    sentence = (
        "A move of 0.1 m in closed loop at R1 = 20 and R2 = 40 mm, simulation set, PD of (5.4) with a filter of 20 "
        f"Hz, 10000 counts in place of the 500 of the text: {value['6.overshoot_10000']:.1f} mm of overshoot and "
        f"{value['6.tension_moving_10000']:.3f} N at constant velocity. With 500 counts the overshoot is "
        f"{value['6.overshoot']:.1f} mm and the tension {value['6.tension_moving']:.2f} N."
    )
    return Picture("6.2", sentence, figure)


PARTS = (
    Part("motors without a loop", OPEN, open_loop, {"6.1": figure_6_1}),
    Part("radii at arming", RADIUS, arming),
    Part("a move in closed loop", CLOSED, closed_loop, {"6.2": figure_6_2}),
)
