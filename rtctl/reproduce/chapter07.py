"""Chapter 7, the prototype: the motor driver (figure 7.4), the motors, the encoder."""

import math

import numpy as np

from rtctl.drivers import l292
from rtctl.drivers.l292 import L292Settings
from rtctl.identify.frf import drive
from rtctl.plants import ivu
from rtctl.reproduce import figures as fig
from rtctl.reproduce.played import config, play
from rtctl.reproduce.rows import NONE, Part, Picture, Row, under

STALL, SLIP = 0.1, 2.5e-3  # A, current that moves a full reel; Nm, torque of the slip couplings (7.3)
SLIP_5 = 3.0e-3  # Nm, torque of the slip couplings by 5.1
GEAR, NOMINAL, AT_NOMINAL, AT_NO_LOAD = 150.4, 0.45, 0.118, 0.024  # ratio, Nm and A of motor 707 (appendix E)
ACCURACY = 1e-3  # m, of positioning (7.4)

L_M = "L_M = 65 mH, from R = 170 kohm; the text lists no inductance"
R_4 = "R_4 = 400 ohm, from the printed C = 1.24e-4 R_F C_F"

DRIVER = under(
    Row("7.sensing_resistor", "R_S for 2 A at 10 V", "7.2, (7.2)", 0.24, "ohm", 0.01,
        quote=r"hence  $R_S = 0.24$  [ $\Omega$ ]", chosen="R_2 R_4 / (R_1 R_3) = 0.048, from R_S = 0.24 ohm",
        remark="24 V drive no more than 0.41 A through the 58 ohm of appendix E"),
    Row("7.cutoff_filter", "corner of the current filter with R_F and C_F", "7.2", 3.0, "kHz", 0.02,
        quote="for this bandwidth is 3 [kHz]"),
    Row("7.error_capacitor", "C for zeta = 0.71", "7.2", 6.6, "nF", 0.03, quote="$C = 6.6$  [nF]", chosen=R_4),
    Row("7.error_resistor", "R that cancels the motor's pole", "7.2, (7.3)", 170.0, "kohm", 0.02,
        quote=r"we now have  $R = 170$  [k $\Omega$ ]", chosen=L_M),
    Row("7.damping", "damping of the current loop", "7.2", 0.5 * math.sqrt(2), "", 0.02,
        quote=r"If we now choose a damping ratio of  $\zeta = \frac{1}{2}\sqrt{2}$", chosen=R_4),
    Row("7.bandwidth", "bandwidth of the driver, -3 dB", "7.2, figure 7.4", 1.0, "kHz", bound="at least",
        quote="the bandwidth is larger than  $10^3$  [Hz]", remark=f"with {R_4}"),
    Row("7.oscillator", "switching frequency with R_O and C_O", "7.2", 22.0, "kHz", 0.02,
        quote="will be set to 22 [kHz]"),
    set="components of 7.2 and appendix E",
)  # fmt: skip
MOTOR = under(
    Row("7.friction_torque", "torque of the 0.1 A that starts the fullest reel", "7.3", 61.0, "mNm", 0.01,
        quote=r"= 0.1 \cdot 61 \cdot 10^{-3} = 6.1 \cdot 10^{-2}$  [Nm]",
        erratum="0.1 A times 61e-3 Nm/A is 6.1e-3 Nm, a factor of 10", expected=6.1),
    Row("7.slip_torque", "torque of the slip couplings", "7.3", 2.5, "mNm",
        quote=r"the torque applied by the slip couplings, which is  $2.5 \cdot 10^{-3}$  [Nm]",
        erratum="section 5.1 has 3.0e-3 Nm, at the mean radius", expected=3.0, set=NONE),
    Row("7.least_torque", "least torque, friction and the 2.5 mNm of the slip couplings", "7.3", 64.0, "mNm", 0.01,
        quote=r"The total minimum required torque is then  $T = 6.4 \cdot 10^{-2}$  [Nm]",
        erratum="follows from `7.friction_torque`", expected=8.6,
        remark="the motors of the old system, 25 mNm, would be enough; 9.1 mNm with the 3.0 mNm of section 5.1"),
    Row("7.motor_constant", "torque constant of the motor's shaft behind its gear", "7.3, appendix E", 61.0, "mNm/A",
        0.01, quote="see appendix E, motor 9904 120 53 707",
        erratum="61 mNm/A is the constant of the rotor; behind the gear of 150.4:1 the torque is 0.45 Nm at 118 mA, "
        "of which 24 mA flow without load", expected=4787.0,
        set="motor and gear of appendix E",
        remark=f"all of part I uses 61 mNm/A at the reel. Without losses the gear gives {GEAR * 0.061:.1f} Nm/A"),
    set="61 mNm/A of appendix E",
) + under(
    Row("7.motor_torque", "continuous torque of the chosen motor, which is enough", "7.3", 450.0, "mNm",
        bound="at most", quote="DC motor with a continuous torque of 0.45 [Nm], which is more than sufficient",
        remark="the largest torque of the emulated machine in its steps, by 61 mNm/A; 450 mNm is the torque behind "
            "the gear"),
    law="shipped PD, steps of 1 rad", set="identified", filter="derivative 40 Hz",
) + under(
    Row("7.increments", "least increments of the encoder for 1 mm", "7.4", 80.0, "", 0.03,
        quote=r"we need an encoder with a minimum of  $2\pi \cdot 12.5 = 80$  increments", remark="78.5 rounded up"),
)  # fmt: skip


def driver(short: bool) -> dict[str, float]:
    """Rows of (7.1) to (7.3) with the components of the shipped driver."""
    p = L292Settings()
    loop = 2 * p.V_S / (p.V_R * p.R_M) * p.R_S  # G_mo R_S
    wanted = 2 * p.R_F * p.C_F * loop / p.R_4  # C in F for zeta^2 = 1/2
    f = np.geomspace(10.0, 1e5, 4000)
    H = np.abs(l292.transfer_function(p, f))
    return {
        "7.sensing_resistor": p.ratio * 10.0 / p.I_max,
        "7.cutoff_filter": 1e-3 / (2 * np.pi * p.R_F * p.C_F),
        "7.error_capacitor": 1e9 * wanted,
        "7.error_resistor": 1e-3 * p.L_M / p.R_M / p.C,
        "7.damping": l292.second_order(p)[2],
        "7.bandwidth": 1e-3 * float(f[np.argmax(H < H[0] / np.sqrt(2))]),
        "7.oscillator": 1e-3 * l292.f_osc(p),
    }


def motors(short: bool) -> dict[str, float]:
    """Rows of torques by the motor constant, and of the torque in steps of the machine."""
    made = config("ivu", {"reference": {"steps": [{"at": 0.5, "to": 1.0}, {"at": 3.0, "to": 0.0}]}})
    p = ivu.parameters(made.plant)
    run = play(made, 5.0)
    most = max(float(np.abs(run[name]).max()) for name in ("u1", "u2")) * l292.gain(made.plant.driver) * p.K_m1
    return {
        "7.friction_torque": 1e3 * STALL * p.K_m1,
        "7.slip_torque": 1e3 * SLIP_5,
        "7.least_torque": 1e3 * (STALL * p.K_m1 + SLIP),
        "7.motor_constant": 1e3 * NOMINAL / (AT_NOMINAL - AT_NO_LOAD),
        "7.motor_torque": 1e3 * most,
        "7.increments": 2 * np.pi * made.R_c / ACCURACY,
    }


def figure_7_4(short: bool) -> Picture:
    """Figure of the response of the driver, by (7.1) and after the cancellation."""
    f = np.geomspace(10.0, 1e5, 400)
    figure, (above, turn) = fig.panels(2, sharex=True)
    full, short_form = l292.transfer_function(L292Settings(), f), drive(config("ivu"), f)
    for H, color, style, words in ((full, fig.BLUE, "-", "(7.1)"), (short_form, fig.INK, "--", "after (7.3)")):
        above.semilogx(f, fig.db(H), style, color=color, linewidth=1.1, label=words)
        turn.semilogx(f, np.degrees(np.unwrap(np.angle(H))), style, color=color, linewidth=1.1)
    above.set_ylabel("gain [dB, A/V]")
    turn.set(ylabel="phase [deg]", xlabel="frequency [Hz]")
    fig.legend(above)
    sentence = (
        "The motor driver from volts to amperes with the components of the text, R_4 and L_M chosen here: flat to "
        f"{0.001 * l292.cutoff(L292Settings()):.1f} kHz, far above the modes of the tape and the reels."
    )
    return Picture("7.4", sentence, figure)


PARTS = (
    Part("motor driver", DRIVER, driver, {"7.4": figure_7_4}),
    Part("motors and encoder", MOTOR, motors),
)
