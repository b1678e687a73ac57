"""Figures and parts of chapter 8."""

import numpy as np

from rtctl.identify import bench
from rtctl.identify import friction as fr
from rtctl.reproduce import chapter08 as ch
from rtctl.reproduce import figures as fig
from rtctl.reproduce.played import config
from rtctl.reproduce.rows import Part, Picture

STRIBECK = {"term": "friction.stribeck", "node": "motor1", "F_s": 4e-3, "v_s": 0.3}  # chosen: the thesis has no values


def figure_8_2(short: bool) -> Picture:
    """Sensitivity and coherence."""
    _, found = ch.noise(short)
    figure, (above, below) = fig.panels(2, sharex=True)
    above.semilogx(found.f, fig.db(found.S), color=fig.BLUE, linewidth=0.9)
    below.semilogx(found.f, found.coherence, color=fig.GREEN, linewidth=0.9)
    above.set_ylabel("|S| [dB]")
    below.set(ylabel="coherence", xlabel="frequency [Hz]", ylim=(0, 1.05))
    sentence = (
        f"Sensitivity by noise at constant velocity, identified set, {found.averages} windows, with 5 V/rad and 0.5 "
        "Vs/rad chosen here, five times the printed gains: |L| falls through 1 at "
        f"{ch.by_noise(short)['8.bandwidth_fivefold']:.2g} Hz, and |S| is 0 dB from 4 Hz on. The text has 0 dB from 1 "
        "Hz on."
    )
    return Picture("8.2", sentence, figure)


def figure_8_3(short: bool) -> Picture:
    """Measured and fitted response, without and with the delay."""
    found, frf = ch.fitted(short), ch.response_of(short).frf
    _, by_noise = ch.noise(short)
    figure, axes = fig.panels(2, 2, sharex=True)
    late = np.exp(2j * np.pi * found.frfs[0].f * found.tau.value) / np.sinc(found.frfs[0].f * frf.dt)
    for column, model in enumerate((found.models[0] * late, found.models[0])):
        above, turn = axes[column], axes[2 + column]
        for one, color, words in ((by_noise.frf, "#9ecbea", "noise"), (frf, fig.BLUE, "multisine")):
            above.semilogx(one.f, fig.db(one.H), ".", color=color, markersize=2.5, label=words)
            turn.semilogx(one.f, fig.degrees(one.H), ".", color=color, markersize=2.5)
        above.semilogx(found.frfs[0].f, fig.db(model), "--", color=fig.INK, linewidth=1.0, label="model")
        turn.semilogx(found.frfs[0].f, fig.degrees(model), "--", color=fig.INK, linewidth=1.0)
        turn.set(xlabel="frequency [Hz]", ylim=(-450, 0))
        fig.title(above, ("model without delay", f"model with {1e3 * found.tau.value:.2f} ms")[column])
    axes[0].set_ylabel("gain [dB, rad/V]")
    axes[2].set_ylabel("phase [deg]")
    fig.legend(axes[0])
    sentence = (
        f"Measured and fitted response of the identified set at 38/22 mm: K_p = {found.K_p.value:.1f} rad/s^2/A at 1 "
        f"Hz, and the phase agrees with the model with {1e3 * found.tau.value:.2f} ms of delay."
    )
    return Picture("8.3", sentence, figure)


def figure_8_4(short: bool) -> Picture:
    """Friction over velocity with the Stribeck fit, of the shipped machine and of one with a Stribeck term."""
    turns, speeds = (2.0, (0.1, 0.3, 0.6, 1.0, 2.0, 4.0))
    figure, (axes,) = fig.panels(1, height=2.6)
    said = []
    for terms, color, words in (([], fig.BLUE, "dry"), ([STRIBECK], fig.ORANGE, "dry and Stribeck")):
        made = bench.changed(config("ivu"), {"plant.physics": terms})
        records = [bench.play(fr.break_away_config(made, 1)), bench.play(fr.velocity_config(made, speeds, turns))]
        points, refused = fr.points_of(records, turns)
        found = fr.friction(points, refused, "ivu")
        axes.plot([p.v for p in points], [1e3 * p.force for p in points], "o", color=color, markersize=4, label=words)
        for fit, side in ((found.forward, 1.0), (found.backward, -1.0)):
            if fit is None:
                continue
            v = np.linspace(0.0, 4.2, 200)
            fall = (fit.F_S - fit.F_C) * np.exp(-((v / fit.v_s) ** 2)) if fit.F_S and fit.v_s else 0.0
            axes.plot(side * v, side * 1e3 * (fit.F_C + fall + fit.F_v * v), color=color, linewidth=1.0)
        if found.forward is not None:
            said.append(found.forward.F_C)
    axes.set(xlabel="speed of the capstan [rad/s]", ylabel="friction of a motor [mNm]")
    fig.legend(axes)
    sentence = (
        "Friction over velocity, measured by the pulling motor (both motors, capstan and tape together), points and "
        f"fit of (8.3): {1e3 * said[0]:.2f} mNm at any speed on the shipped machine. The falling curve has a "
        "Stribeck term of 4 mNm and 0.3 rad/s at motor 1, chosen here: the text prints no Stribeck parameters."
    )
    return Picture("8.4", sentence, figure)


def figure_8_5(short: bool) -> Picture:
    """Open loop, closed loop, sensitivity, Nyquist, measured and model."""
    got = ch.running_loop(short)
    f = np.geomspace(got.f[0], got.f[-1], 600)
    L = ch.model_loop(short, f)
    figure, (opened, closed, S, nyquist) = fig.panels(2, 2, height=2.4)
    fig.loop((opened, closed, S), got.f, got.L, 1.0, fig.BLUE, "-", "measured")
    fig.loop((opened, closed, S), f, L, 1.0, fig.INK, "--", "model")
    nyquist.plot(L.real, L.imag, "--", color=fig.INK, linewidth=1.0)
    nyquist.plot([-1], [0], "+", color=fig.RED)
    nyquist.set(xlim=(-3, 1.5), ylim=(-2.5, 1.5), aspect="equal", xlabel="real part", ylabel="imaginary part")
    for axes, words in ((opened, "|L| [dB]"), (closed, "|T| [dB]"), (S, "|S| [dB]")):
        axes.set(ylabel=words, xlabel="frequency [Hz]")
    fig.legend(opened)
    sentence = (
        "Loop, closed loop, sensitivity and Nyquist plot of the identified set at 38/22 mm, without filter, with G = "
        f"{ch.loop(short)['8.gain']:.2f} A/rad: {got.margins.GM:.1f} dB and {got.margins.PM:.0f} deg measured in the "
        "running loop."
    )
    return Picture("8.5", sentence, figure)


def figure_8_6(short: bool) -> Picture:
    """Steps of a radian with full and partial friction compensation, by the printed law and with its filter."""
    figure, axes = fig.panels(2, 2, sharex=True)
    for column, tau_C in enumerate((ch.TAU_C, ch.UNDER)):
        above, below = axes[column], axes[2 + column]
        for printed, color, words in ((True, fig.ORANGE, "as printed"), (False, fig.BLUE, "with a filter")):
            record = ch.radian(tau_C, printed)
            t = record.t - record.t[0]
            fig.line(above, t, record["capstan"], color, label=words)
            fig.line(below, t, 1e3 * (record["target"] - record["capstan"]), color)
        fig.line(above, t, record["target"], fig.INK, "--", linewidth=0.8)
        below.set(ylim=(-40, 40), xlabel="time [s]")
        fig.title(above, f"{1e3 * tau_C:g} mNm compensated")
    axes[0].set_ylabel("capstan [rad]")
    axes[2].set_ylabel("error [mrad]")
    fig.legend(axes[0], loc="center right")
    cases = ((True, True), (True, False), (False, True), (False, False))  # (printed law, tape without compression)
    said = [" and ".join(f"{e:.1f}" for e in ch.errors(ch.steps.steps(ch.radian(ch.TAU_C, *case)))) for case in cases]
    pushes = ch.radian(ch.TAU_C, slack=False)
    least = min(float(pushes[f"truth_tension{i}"].min()) for i in (1, 2))
    sentence = (
        "Steps of a radian at 25/35 mm, identified set, tape that cannot push: with 2.4 mNm compensated the errors "
        f"are {said[0]} mrad with the law as printed, and {said[2]} mrad with the shipped filter of 40 Hz on the "
        f"derivative. Without tape.slack the tape pushes ({least:.1f} N), and the errors are {said[1]} mrad as "
        f"printed and {said[3]} mrad with the filter. The text has 9.8 and 10.6 mrad."
    )
    return Picture("8.6", sentence, figure)


PARTS = (
    Part("identification by a multisine", ch.IDENTIFIED, ch.identification, {"8.3": figure_8_3}),
    Part("sensitivity by noise", ch.NOISE, ch.by_noise, {"8.2": figure_8_2}),
    Part("unknown machines", ch.UNKNOWN, ch.unknown),
    Part("friction", ch.FRICTION, ch.friction, {"8.4": figure_8_4}),
    Part("position controller", ch.LOOP, ch.loop, {"8.5": figure_8_5}),
    Part("margins over the radii", ch.RADII, ch.over_radii),
    Part("steps of a radian", ch.STEPS, ch.radians, {"8.6": figure_8_6}),
)
