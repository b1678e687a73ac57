"""Chapter 4, modelling: inertia that follows the tape, modes of the simulation set (figures 4.2 and 4.3)."""

from functools import cache
from typing import NamedTuple

import numpy as np

from rtctl.design import response
from rtctl.identify.frf import drive
from rtctl.plants import ivu
from rtctl.reproduce import figures as fig
from rtctl.reproduce.played import config, play, reels
from rtctl.reproduce.rows import Part, Picture, Row

MOVE, SPEED = 0.2, 0.02  # m and m/s, of one operation (3, 4.1)
R_C = 0.0125  # m
LISTED, PAPER = 0.5e-3, 0.05e-3  # m, thickness in appendix A, and the one that figure 4.2 was drawn with
ASKED_J_10 = 3.2e-5  # kg m^2, with which the mode of an empty reel is at 250 Hz
PAIRS = ((0.02, 0.02), (0.02, 0.04), (0.04, 0.02), (0.04, 0.04))  # m, of figure 4.3

ROWS = (
    Row(
        "4.inertia_change", "change of J of an empty reel in a move of 0.2 m", "figure 4.2, (4.1)-(4.8)", 2.5, "%",
        0.03, expected=26.2,
        erratum="26 % with the listed d_tape = 0.5 mm; 2.5 % is that of paper of 0.05 mm (next row)",
    ),
    Row(
        "4.inertia_change_thin", "the same with paper of 0.05 mm", "figure 4.2, (4.1)-(4.8)", 2.5, "%", 0.03,
        remark="the thickness with which the equations give figure 4.2",
    ),
    Row("4.mode_full", "mode of shaft and reel 1, R1 = 40 mm, simulation set", "4.2, figure 4.3", 100.0, "Hz", 0.05),
    Row(
        "4.mode_empty", "mode of shaft and reel 1, R1 = 20 mm, simulation set", "4.2, figure 4.3", 250.0, "Hz", 0.02,
        erratum="450 Hz with the listed J_10 = 1e-5 kg m^2; 250 Hz takes 3.2e-5 (next row)", expected=450.0,
    ),
    Row("4.mode_empty_heavy", "the same with J_10 = 3.2e-5 kg m^2", "4.2, figure 4.3", 250.0, "Hz", 0.03),
    Row(
        "4.mode_tape", "mode of tape and both reels, 20/20 mm, simulation set", "4.2", 1.0, "Hz", 0.5, relative=False,
        remark="the text prints whole hertz; 1.15 Hz at 20/20 mm and 2.0 Hz at 40/40 mm",
    ),
)  # fmt: skip


class Change(NamedTuple):
    R1: float  # m, before the move
    R: float  # %, of the radius
    J: float  # %, of the inertia


@cache
def move(R1: float, d_tape: float) -> Change:
    """One move of 0.2 m that winds paper of `d_tape` m on reel 1, played on the emulator."""
    changes = {
        "plant.set": "simulation",
        "plant.parameters.d_tape": d_tape,
        "radius.d_tape": d_tape,
        "safety.following_error": 0,
        "reference": {"steps": [{"at": 0.5, "to": MOVE / R_C, "ramp": SPEED / R_C}]},
    }
    R2 = 0.04 if R1 < 0.04 else 0.03
    run = play(reels(R1, R2, changes), 1.0 + 0.5 + MOVE / SPEED + 1.5)
    ends = run["truth_R1"][[0, -1]]
    p = ivu.parameters(config("ivu", {"plant.set": "simulation"}).plant)
    J = p.J_10 + 0.5 * np.pi * p.rho_tape * p.h_tape * (ends**4 - p.R_min**4)  # (4.1)
    return Change(R1, *(float(100 * (x[1] / x[0] - 1)) for x in (ends, J)))


def modes(R1: float, R2: float, **parameters: float) -> np.ndarray:
    """Frequencies in Hz of the modes of the simulation set, rising."""
    model = simulated(R1, R2, **parameters).model
    found = np.linalg.eigvals(model.A[: 2 * ivu.NQ, : 2 * ivu.NQ])
    return np.sort(np.abs(found[found.imag > 1e-3])) / (2 * np.pi)


def simulated(R1: float, R2: float, **parameters: float) -> response.Loop:
    """The simulation set of appendix A with these radii, motor 1 pulling."""
    changes = {f"plant.parameters.{name}": value for name, value in parameters.items()}
    return response.take(reels(R1, R2, {"plant.set": "simulation", **changes}))


def model(short: bool) -> dict[str, float]:
    """Moves on the emulator, modes of its matrices."""
    return {
        "4.inertia_change": move(0.02, LISTED).J,
        "4.inertia_change_thin": move(0.02, PAPER).J,
        "4.mode_full": modes(0.04, 0.02)[1],
        "4.mode_empty": modes(0.02, 0.02)[1],
        "4.mode_empty_heavy": modes(0.02, 0.02, J_10=ASKED_J_10, J_20=ASKED_J_10)[1],
        "4.mode_tape": modes(0.02, 0.02)[0],
    }


def figure_4_2(short: bool) -> Picture:
    """Change of radius and inertia in a move, over the radius."""
    radii = np.linspace(0.02, 0.04, 3 if short else 9)
    figure, axes = fig.panels(1, 2)
    for d_tape, color in ((LISTED, fig.BLUE), (PAPER, fig.ORANGE)):
        moves = [move(float(R), d_tape) for R in radii]
        for one, name in zip(axes, ("R", "J"), strict=True):
            one.semilogy(1e3 * radii, [getattr(m, name) for m in moves], "o-", color=color, markersize=3,
                         label=f"paper of {1e3 * d_tape:g} mm")  # fmt: skip
            one.set(xlabel="R1 before the move [mm]", ylabel=f"change of {name} [%]")
    fig.legend(axes[1])
    worst = [move(0.02, d).J for d in (LISTED, PAPER)]
    sentence = (
        "Change of radius and inertia of reel 1 in a move of 0.2 m on the emulator: the inertia of an empty reel "
        f"changes by {worst[0]:.0f} % with the listed paper of 0.5 mm and by {worst[1]:.1f} %, the number of the "
        "thesis, with paper of 0.05 mm."
    )
    return Picture("4.2", sentence, figure)


def figure_4_3(short: bool) -> Picture:
    """Response from the current of motor 1 to the capstan at four pairs of radii."""
    f = np.geomspace(0.1, 1000.0, 300 if short else 1200)
    D = drive(config("ivu"), f)
    figure, (above, turn) = fig.panels(2, sharex=True)
    for (R1, R2), color in zip(PAIRS, fig.COLORS, strict=True):
        H = response.plant_response(simulated(R1, R2).model, f) / D
        above.semilogx(f, fig.db(H), color=color, linewidth=1.1, label=f"{1e3 * R1:g}/{1e3 * R2:g} mm")
        turn.semilogx(f, fig.degrees(H), color=color, linewidth=1.1)
    above.set(ylabel="gain [dB, rad/A]")
    turn.set(ylabel="phase [deg]", xlabel="frequency [Hz]")
    fig.legend(above, ncols=2)
    sentence = (
        "From the current of motor 1 to the capstan with the listed simulation set: the mode of shaft and reel is "
        f"at {modes(0.04, 0.02)[1]:.0f} Hz where reel 1 is full and at {modes(0.02, 0.02)[1]:.0f} Hz where it is "
        "empty."
    )
    return Picture("4.3", sentence, figure)


PARTS = (Part("modelling", ROWS, model, {"4.2": figure_4_2, "4.3": figure_4_3}),)
