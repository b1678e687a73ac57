"""Chapter 9 and appendix E: motors of the reel unit, requirements of moves, and comparison with a brushless motor."""

import math

import numpy as np

from rtctl.design import motors
from rtctl.design.motors import APPENDIX_E, BARE, BRUSHLESS, RPM, Fit, Motor, Move
from rtctl.reproduce import figures as fig
from rtctl.reproduce.rows import Part, Picture, Row, under

GEARED = APPENDIX_E[1]  # 150.4:1
SMALL, LARGE = 0.020, 0.040  # m
PAPER = 0.5 * math.pi * 1700.0 * 0.037 * (LARGE**4 - SMALL**4)  # kg m^2, paper of one full reel
MOVES = {"0.2 m at 0.02 m/s": (0.2, 10.0), "0.2 m in 2 s": (0.2, 2.0), "12.5 mm in 1 s": (0.0125, 1.0)}
LIMIT = 1.0  # N, tension at which a motor should yield; ten times F_t
OTHER = "It is also recommended to use other DC motors"
SAME = "Brushless DC motors are able to deliver the same continuous torque using a smaller transmission ratio"
LINE = "9904 120 537..	24	58	3550	23	61"
GEAR = "707			24	28.8			24.4	18.6	24	118"

MOTORS = under(
    Row("9.most_current", "current of 24 V through 58 ohm", "Appendix E", None, "A", 0.01, quote=LINE, expected=0.414,
        remark="no number in the text; (7.2) allows 2 A, which is never reached"),
    Row("9.stall_torque", "torque at standstill by K V / R, less that of 24 mA", "Appendix E", 23.0, "mNm", 0.05,
        quote=LINE),
    Row("9.no_load_speed", "speed without load by (V - R I_0) / K", "Appendix E", 3550.0, "rpm", 0.01, quote=LINE),
    Row("9.gear_speed", "speed without load behind the gear of 150.4", "Appendix E", 24.4, "rpm", 0.05, quote=GEAR),
    Row("9.gear_constant", "torque constant behind the gear of 150.4 over K_m of the identified set", "Appendix A", 1.0,
        "",
        0.01, quote="$K_{m1} = K_{m2}$	6.1e-2	6.1e-2	Motor constant 1", expected=150.4,
        erratum="61 mNm/A is the constant of the rotor; the reels are behind a gear of 150.4, where the constant is "
            "9.2 Nm/A"),
    Row("9.gear_friction", "friction behind the gear, of 24 mA, over the torque of 0.1 N at 30 mm", "9", None, "",
        bound="at least", expected=1.0, quote="This transmission also introduces large friction forces",
        remark="no number in the text; the identified 2.4 mNm are 1.6 times the friction of the rotor, 1.5 mNm, and "
        "1 % of the friction behind the gear. The motor has to drive a paying reel behind this gear; the tape cannot "
        "turn it"),
    Row("9.motor_speed", "speed for 0.2 m in 2 s, R = 20 mm, over the speed behind the gear of 150.4", "9", None, "",
        bound="at least", expected=1.0, quote=OTHER, remark="no number in the text: 0.2 m in 2 s is too fast for the "
            "gear; 0.02 m/s is not"),
    Row("9.motors_fit", "motors of appendix E, with a gear, that can do every move and that 1 N turns back", "9", None,
        "", 0.0, expected=0.0, quote=OTHER, remark="no number in the text; 1 N is chosen here, ten times F_t"),
    Row("9.brushless_fit", "moves that a brushless motor behind 4:1 can do, while 1 N turns it back", "9", None, "",
        0.0,
        expected=3.0, quote=SAME, set="brushless motor chosen here: 24 V, 1.2 ohm, 33.5 mNm/A, 9.2e-6 kg m^2",
        remark="no number in the text"),
    set="appendix E, rotor of 6.6e-8 kg m^2 chosen from J_m = 1.5e-3 kg m^2",
)  # fmt: skip


def asked() -> dict[str, tuple[Move, float]]:
    """Moves at the two worst radii: the small radius for speed, the large radius for torque."""
    found = {}
    for words, (distance, seconds) in MOVES.items():
        for R in (SMALL, LARGE):
            found[f"{words}, R = {1e3 * R:.0f} mm"] = (motors.move(distance, seconds, R), R)
    return found


def fits(motor: Motor) -> dict[str, Fit]:
    """Fit of a motor to every move."""
    return {words: motors.fit(motor, move, R, PAPER) for words, (move, R) in asked().items()}


def good(motor: Motor) -> int:
    """Number of moves that a motor can do at every radius."""
    found = fits(motor)
    return sum(all(one.good for name, one in found.items() if name.startswith(words)) for words in MOVES)


def selection(short: bool) -> dict[str, float]:
    """Rows of the motors of appendix E and of a brushless motor."""
    quick, _ = asked()["0.2 m in 2 s, R = 20 mm"]
    return {
        "9.most_current": BARE.volts / BARE.resistance,
        "9.stall_torque": 1e3 * BARE.stall,
        "9.no_load_speed": BARE.no_load / RPM,
        "9.gear_speed": GEARED.no_load / RPM,
        "9.gear_constant": GEARED.gear * GEARED.K / 61e-3,
        "9.gear_friction": GEARED.friction / 3.0e-3,
        "9.motor_speed": quick.speed / GEARED.no_load,
        "9.motors_fit": sum(good(motor) == len(MOVES) for motor in APPENDIX_E),
        "9.brushless_fit": good(BRUSHLESS),
    }


def figure_9_2(short: bool) -> Picture:
    """Figure of torque over speed of each motor, the moves, and the selection table."""
    figure, (axes, table) = fig.panels(1, 2, height=3.4)
    every = (*APPENDIX_E, BARE, BRUSHLESS)
    colors = (fig.BLUE, fig.ORANGE, "#4aa3a0", fig.RED, fig.GREY, fig.INK, "#8a4f9e")
    for motor, color in zip(every, colors, strict=True):
        w = np.linspace(0.0, motor.no_load, 100)
        axes.loglog(w[1:] / RPM, [max(motor.at(x), 1e-4) for x in w[1:]], color=color, linewidth=1.1, label=motor.name)
    for move, R in asked().values():
        axes.plot(move.speed / RPM, motors.fit(BARE, move, R, PAPER).torque, "x", color=fig.INK, markersize=5)
    axes.set(xlabel="speed [rpm]", ylabel="torque [Nm]", ylim=(1e-3, 30.0), xlim=(1.0, 1e4))
    fig.legend(axes, fontsize=6, loc="upper right")
    fig.title(axes, "behind the gear; x: moves, bare motor")
    table.axis("off")
    table.plot([0.0, 1.0], [0.0, 0.0], color=fig.GREY, linewidth=0.6)
    table.set_ylim(0.0, 1.0)
    cells = []
    for motor in every:
        found = fits(motor)
        most = max(one.current for one in found.values())
        fitting = f"{good(motor)} of {len(MOVES)}"
        cells.append(
            [motor.name, f"{1e3 * motor.friction:.4g}", f"{motor.friction / SMALL:.3g}", f"{most:.2f}", fitting]
        )
    made = table.table(cells, colLabels=["motor", "friction\n[mNm]", "turned\nback [N]", "most\n[A]", "moves"],
                       loc="center", colWidths=[0.38, 0.16, 0.16, 0.15, 0.15])  # fmt: skip
    made.auto_set_font_size(False)
    made.set_fontsize(7)
    made.scale(1.0, 1.6)
    sentence = (
        "Not in the text: torque over speed of the 24 V motors of appendix E and of a brushless motor, with the "
        "torque and speed of three moves at 20 and 40 mm: 0.2 m at 0.02 m/s, 0.2 m in 2 s and 12.5 mm in 1 s. A move "
        "counts as possible where the motor has torque left at the speed of the move, and the tape turns the motor "
        "of the other reel back with less than 1 N."
    )
    return Picture("9.2", sentence, figure)


PART = Part("motors", MOTORS, selection, {"9.2": figure_9_2})
