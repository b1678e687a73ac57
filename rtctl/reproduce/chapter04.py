"""Chapter 4, modelling: inertia by wound tape, modes of the simulation set (figures 4.2 and 4.3)."""

from functools import cache
from typing import NamedTuple

import numpy as np

from rtctl.design import response
from rtctl.identify.frf import drive
from rtctl.plants import ivu
from rtctl.reproduce import figures as fig
from rtctl.reproduce.played import config, play, reels
from rtctl.reproduce.rows import Part, Picture, Row, under

MOVE, SPEED = 0.2, 0.02  # m and m/s, of one operation (3, 4.1)
R_C = 0.0125  # m
LISTED, PAPER = 0.5e-3, 0.05e-3  # m, tape thickness of appendix A and of figure 4.2
ASKED_J_10 = 3.2e-5  # kg m^2, J_10 for a mode of an empty reel at 250 Hz
PAIRS = ((0.02, 0.02), (0.02, 0.04), (0.04, 0.02), (0.04, 0.04))  # m, of figure 4.3

SIMULATION = "simulation"

ROWS = under(
    Row("4.inertia_change", "change of J of an empty reel in a move of 0.2 m", "4.1, figure 4.2", 2.5, "%", 0.03,
        quote="the maximum change in inertia is only 2.5%", expected=26.2,
        erratum="26 % with the listed d_tape = 0.5 mm; 2.5 % with paper of 0.05 mm (next row)"),
    Row("4.inertia_change_thin", "change of J of an empty reel with paper of 0.05 mm", "4.1, figure 4.2", 2.5, "%",
        0.03,
        quote="the maximum change in inertia is only 2.5%", set="simulation, d_tape = 0.05 mm",
        chosen="d_tape = 0.05 mm, a tenth of the listed value"),
    law="shipped PD, 0.02 m/s", set=SIMULATION, filter="derivative 40 Hz",
) + under(
    Row("4.mode_full", "damped mode of shaft and reel 1, R1 = 40 mm", "4.2, figure 4.3", 100.0, "Hz", 0.05,
        quote="this eigenfrequency shifts to  $f = 100$  [Hz]", remark="at 40/20 mm"),
    Row("4.mode_empty", "damped mode of shaft and reel 1, R1 = 20 mm", "4.2, figure 4.3", 250.0, "Hz", 0.02,
        quote="show an eigenfrequency at  $f = 250$  [Hz]",
        erratum="445 Hz with the listed J_10 = 1e-5 kg m^2; 250 Hz needs 3.2e-5 (next row)", expected=445.0,
        remark="at 20/20 mm"),
    Row("4.mode_empty_heavy", "damped mode of shaft and reel 1, R1 = 20 mm, J_10 = 3.2e-5 kg m^2", "4.2, figure 4.3",
        250.0, "Hz", 0.03,
        quote="show an eigenfrequency at  $f = 250$  [Hz]", set="simulation, J_10 = J_20 = 3.2e-5 kg m^2",
        chosen="J_10 = J_20 = 3.2e-5 kg m^2, three times the listed value"),
    Row("4.mode_tape", "damped mode of tape and both reels, 40/20 mm", "4.2", 1.0, "Hz", 0.5, relative=False,
        quote="Also the eigenfrequency at  $f = 1$  [Hz], introduced by the paper dynamics, is strongly damped",
        remark="whole hertz in the text; 1.1 Hz at 20/20 mm, 1.4 Hz at 40/20 mm, 1.6 Hz at 40/40 mm"),
    Row("4.decoupling", "least gain below the mode of the tape, 40/20 mm", "8.1", 1.0, "Hz", 0.1,
        quote="In the simulation model this decoupling occurred at  $f = 1$  [Hz]",
        remark="least |H| f^2; the anti-resonance is at 1.08 Hz, damped"),
    Row("4.m_1", "mass of the paper on reel 1, R1 = 40 mm", "Appendix A", 0.23, "kg", 0.04,
        quote="$m_1$	2.3e-1	2.0e-2	reel mass",
        remark="m = pi rho h (R^2 - R_min^2) of 4.1; two digits in the text"),
    set=SIMULATION,
)  # fmt: skip


class Change(NamedTuple):
    R1: float  # m, before the move
    R: float  # %, change of the radius
    J: float  # %, change of the inertia


@cache
def move(R1: float, d_tape: float) -> Change:
    """Changes by a move of 0.2 m on the emulator that winds paper of thickness `d_tape` in m on reel 1."""
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
    """Damped frequencies in Hz of the modes of the simulation set, rising."""
    return damped_modes(simulated(R1, R2, **parameters).model)


def damped_modes(model: response.Model) -> np.ndarray:
    """Damped frequencies in Hz of a reel unit's modes, rising."""
    found = np.linalg.eigvals(model.A[: 2 * ivu.NQ, : 2 * ivu.NQ])
    return np.sort(found.imag[found.imag > 1e-3]) / (2 * np.pi)


def mass_line(model: response.Model, low: float, high: float) -> tuple[float, float]:
    """Frequencies in Hz of the minimum and maximum of |H| f^2 between `low` and `high` Hz."""
    f = np.geomspace(low, high, 2000)
    above = np.abs(response.plant_response(model, f)) * f**2
    return float(f[np.argmin(above)]), float(f[np.argmax(above)])


def paper_mass(R: float) -> float:
    """Mass in kg of the paper on a reel of radius `R` m (4.1), alike in both parameter sets."""
    p = ivu.parameters(config("ivu").plant)
    return float(np.pi * p.rho_tape * p.h_tape * (R**2 - p.R_min**2))


def simulated(R1: float, R2: float, **parameters: float) -> response.Loop:
    """Loop of the simulation set of appendix A at these radii in m, driven by motor 1."""
    changes = {f"plant.parameters.{name}": value for name, value in parameters.items()}
    return response.take(reels(R1, R2, {"plant.set": "simulation", **changes}))


def model(short: bool) -> dict[str, float]:
    """Rows of moves on the emulator, and of modes of its matrices."""
    return {
        "4.inertia_change": move(0.02, LISTED).J,
        "4.inertia_change_thin": move(0.02, PAPER).J,
        "4.mode_full": modes(0.04, 0.02)[1],
        "4.mode_empty": modes(0.02, 0.02)[1],
        "4.mode_empty_heavy": modes(0.02, 0.02, J_10=ASKED_J_10, J_20=ASKED_J_10)[1],
        "4.mode_tape": modes(0.04, 0.02)[0],
        "4.decoupling": mass_line(simulated(0.04, 0.02).model, 0.3, 2.0)[0],
        "4.m_1": paper_mass(0.04),
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
        f"changes by {worst[0]:.0f} % with the listed paper of 0.5 mm, and by {worst[1]:.1f} %, the number of the "
        "thesis, with paper of 0.05 mm, chosen here. Simulation set, shipped PD."
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
        "Response from the current of motor 1 to the capstan with the listed simulation set: the mode of shaft and "
        f"reel is at {modes(0.04, 0.02)[1]:.0f} Hz with a full reel 1, and at {modes(0.02, 0.02)[1]:.0f} Hz with an "
        "empty one."
    )
    return Picture("4.3", sentence, figure)


PARTS = (Part("modelling", ROWS, model, {"4.2": figure_4_2, "4.3": figure_4_3}),)
