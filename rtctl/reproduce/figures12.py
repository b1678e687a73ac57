"""Figures and parts of chapter 12."""

from typing import Any

import numpy as np

from rtctl.design import mechanics, response, shaping
from rtctl.plants import ldu
from rtctl.plants.ldu import LduParameters, LduSettings
from rtctl.reproduce import chapter12 as ch
from rtctl.reproduce import figures as fig
from rtctl.reproduce import heads12, stroke12
from rtctl.reproduce.played import config
from rtctl.reproduce.rows import Part, Picture

QUICK = (2 * np.pi * 1e5, 0.7)  # rad/s and damping of an amplifier without visible effect
UNDAMPED = {"b_s": 0.0, "b_c": 0.0, "B_c": 0.0, "B_m": 0.0, "K_m2": 0.0}


def carriage(p: LduParameters, f: np.ndarray) -> np.ndarray:
    """Response (n,) of the carriage (m) to the motor's current (A) at `f` (n,) Hz."""
    A, B = ldu.state_space(ldu.build(LduSettings(parameters=p), 1e-4, QUICK))
    return response.plant_response(response.Model(A, B[:, 0], p.R_c * np.eye(ldu.NX)[ldu.CAPSTAN]), f)


def figure_12_2(short: bool) -> Picture:
    """Bode plot of both parameter sets without damping."""
    f = np.geomspace(10.0, 5e3, 400 if short else 2000)
    figure, (above, turn) = fig.panels(2, sharex=True)
    for name, color in (("figure_12_2", fig.BLUE), ("appendix_f", fig.ORANGE)):
        p = mechanics.named(name)
        modes = mechanics.modes(p)
        turns = 1 + np.searchsorted(modes.resonances, f) - np.searchsorted(modes.anti_resonances, f)
        H = carriage(p.model_copy(update=UNDAMPED), f)
        above.semilogx(f, fig.db(H), color=color, linewidth=1.0, label=name)
        turn.semilogx(f, -180 * turns, color=color, linewidth=1.0)
    above.set_ylabel("gain [dB, m/A]")
    turn.set(ylabel="phase [deg]", xlabel="frequency [Hz]")
    fig.legend(above)
    value = ch.modes(short)
    first, zero, second, third = (value[f"12.{name}"] for name, _, _ in ch.LISTED)
    sentence = (
        f"Motor current to carriage without damping: modes at {first:.0f}, {second:.0f} and {third:.0f} Hz and an "
        f"anti-resonance at {zero:.0f} Hz in the set figure_12_2, whose k_s, k_c and M are chosen here from the "
        "figure of the text, and higher with the values of appendix F."
    )
    return Picture("12.2", sentence, figure)


def figure_12_3(short: bool) -> Picture:
    """Amplifier: current over voltage."""
    found = ch.curve()
    V = np.array([level.volts for level in found.levels])
    figure, (axes,) = fig.panels(1, height=2.4)
    axes.plot(V, [1e3 * level.ampere for level in found.levels], "o", color=fig.BLUE, markersize=4, label="measured")
    axes.plot(V, 1e3 * (found.I_0 + found.gain * np.maximum(V - found.V_k, 0)), color=fig.INK, linewidth=1.0,
              label="(12.3), fitted")  # fmt: skip
    axes.set(xlabel="input [V]", ylabel="motor current [mA]", ylim=(0, None))
    fig.legend(axes)
    sentence = (
        f"Current of the motor driver over its input, the motor held: {1e3 * found.I_0:.0f} mA up to "
        f"{found.V_k:.2f} V, and {found.gain:.3f} A/V above."
    )
    return Picture("12.3", sentence, figure)


def figure_12_4(short: bool) -> Picture:
    """Signals of the sensitivity measurement at the points of the block diagram."""
    record = ch.noise()[0][0]
    t = record.t - record.t[0]
    span = (t > 2.0) & (t < 2.05)
    figure, axes = fig.panels(3, sharex=True, height=1.4)
    for one, y, words in zip(axes, (record["w"], record["u"], 1e3 * record.position),
                             ("noise w [V]", "command u [V]", "position x [mm]"), strict=True):  # fmt: skip
        fig.line(one, t[span], y[span], linewidth=0.7)
        one.set_ylabel(words)
    axes[2].set_xlabel("time [s]")
    most = ch.identification(short)["12.excitation"]
    sentence = (
        "In place of the block diagram of the text, signals of the sensitivity measurement in motion at 5 mm/s: "
        f"noise is added to the output of the controller, and the written command stays below {most:.2f} V."
    )
    return Picture("12.4", sentence, figure)


def figure_12_5(short: bool) -> Picture:
    """Sensitivity, and the response of the linear drive."""
    (_, found), best = ch.noise(), ch.response_of()
    figure, (S, H, coherence, phase) = fig.panels(2, 2)
    inside = found.f < 250
    S.semilogx(found.f[inside], fig.db(found.S[inside]), color=fig.BLUE, linewidth=0.8)
    coherence.semilogx(found.f[inside], found.coherence[inside], color=fig.GREEN, linewidth=0.8)
    model = response.plant(config("ldu"), best.f)
    H.semilogx(best.f, fig.db(best.G), ".", color=fig.BLUE, markersize=2.5, label="measured")
    H.semilogx(best.f, fig.db(model), "--", color=fig.INK, linewidth=1.0, label="model")
    phase.semilogx(best.f, fig.degrees(best.G), ".", color=fig.BLUE, markersize=2.5)
    phase.semilogx(best.f, fig.degrees(model), "--", color=fig.INK, linewidth=1.0)
    for axes, words in ((S, "|S| [dB]"), (coherence, "coherence"), (H, "gain [dB, m/V]"), (phase, "phase [deg]")):
        axes.set_ylabel(words)
    for axes in (coherence, phase):
        axes.set_xlabel("frequency [Hz]")
    fig.legend(H)
    sentence = (
        "Sensitivity by noise, and the response of the linear drive by a multisine, set figure_12_2: a mass up to 50 "
        f"Hz with {ch.identification(short)['12.process_gain']:.2f} m/s^2/A, and its mode at 114 Hz; the model has no "
        "delay. The resonances of print heads and other features, which the text shows from 50 to 220 Hz, are not in "
        "this set; figure 12.11 has them."
    )
    return Picture("12.5", sentence, figure)


def figure_12_6(short: bool) -> Picture:
    """Effect of the radii of capstan and wheel."""
    f = np.geomspace(10.0, 2e3, 300 if short else 1000)
    p = mechanics.named("figure_12_2")
    figure, axes = fig.panels(1, 2, height=2.6)
    varied: tuple[tuple[str, list[tuple[float, float]]], ...] = (
        ("R_c", [(R, p.R_t) for R in (2e-3, 3e-3, 4.5e-3, 6.2e-3)]),
        ("R_t", [(p.R_c, R) for R in (40e-3, 30e-3, 23e-3, 15e-3)]),
    )
    for one, (name, pairs) in zip(axes, varied, strict=True):
        for (R_c, R_t), color in zip(pairs, fig.COLORS, strict=True):
            R = R_c if name == "R_c" else R_t
            H = carriage(mechanics.with_radii(p, R_c, R_t), f)
            one.semilogx(f, fig.db(H), color=color, linewidth=1.0, label=f"{name} = {1e3 * R:g} mm")
        one.set(xlabel="frequency [Hz]", ylim=(-200, -50))
        fig.legend(one)
    axes[0].set_ylabel("gain [dB, m/A]")
    best = mechanics.optimum(mechanics.named())
    sentence = (
        "Effect of the radii of capstan and wheel on the response to the motor's current, drawn with the set "
        f"figure_12_2. With appendix F the best pair, {1e3 * best.R_c:.1f} and {1e3 * best.R_t:.1f} mm, gains "
        f"{best.gain:.1f} dB; the text has 6.2 and 23 mm."
    )
    return Picture("12.6", sentence, figure)


def figure_12_8(short: bool) -> Picture:
    """Closed loop and sensitivity with the present controller."""
    reached = ch.running("present").margins
    figure = _loop(config("ldu"), "present")
    sentence = (
        "Closed loop and sensitivity with the present controller, its gains chosen here for 8 Hz and 2 dB, measured "
        f"in the running loop and computed by the model, set figure_12_2: {reached.bandwidth:.1f} Hz, and "
        f"{reached.GM:.1f} dB of gain margin."
    )
    return Picture("12.8", sentence, figure)


def figure_12_9(short: bool) -> Picture:
    """Controller, closed loop and sensitivity with the lead-lag controller."""
    reached = ch.running("shaped").margins
    first, second = sorted(ch.depths(), reverse=True)
    figure = _loop(shaping.applied(config("ldu"), ch.shaped().law), "shaped")
    sentence = (
        "Lead-lag, notches and low-pass, found by optimisation for 11 dB and 60 deg on the measured response: "
        f"{reached.bandwidth:.0f} Hz, {reached.GM:.1f} dB and {reached.PM:.0f} deg measured in the running loop. One "
        f"of the two notches reduces the gain by {first:.0f} dB, the other by {second:.1f} dB, since this set has "
        "none of the resonances of the print heads; figure 12.11 has them."
    )
    return Picture("12.9", sentence, figure)


def _loop(made: Any, which: str) -> Any:
    """Figure of controller, loop, closed loop and sensitivity, measured and by the model."""
    got = ch.running(which)
    f = np.geomspace(1.0, 400.0, 600)
    L = response.loop(made, f)
    parts = response.take(made)
    figure, (law, opened, closed, S) = fig.panels(2, 2)
    law.semilogx(f, fig.db(response.law_response(parts, f)), color=fig.INK, linewidth=1.0)
    share_got, share = (response.law_response(parts, x, "reference") / response.law_response(parts, x)
                        for x in (got.f, f))  # fmt: skip
    fig.loop((opened, closed, S), got.f, got.L, share_got, fig.BLUE, "-", "measured")
    fig.loop((opened, closed, S), f, L, share, fig.INK, "--", "model")
    for axes, words in ((law, "controller [dB, V/m]"), (opened, "|L| [dB]"), (closed, "|T| [dB]"), (S, "|S| [dB]")):
        axes.set_ylabel(words)
    for axes in (closed, S):
        axes.set_xlabel("frequency [Hz]")
    fig.legend(opened)
    return figure


PARTS = (
    Part("mechanics", ch.MODES, ch.modes, {"12.2": figure_12_2}),
    Part("motor driver", ch.AMPLIFIER, ch.amplifier, {"12.3": figure_12_3}),
    Part("identification", ch.RESPONSE, ch.identification, {"12.4": figure_12_4, "12.5": figure_12_5}),
    Part("radii and friction wheels", ch.MECHANICS, ch.wheels, {"12.6": figure_12_6}),
    Part("notch filter", ch.NOTCH, ch.notch),
    Part("friction", ch.FRICTION, ch.friction),
    Part("present controller", ch.PRESENT, ch.present, {"12.8": figure_12_8}),
    Part("lead-lag controller", ch.SHAPED, ch.optimised, {"12.9": figure_12_9}),
    heads12.PART,
    stroke12.PART,
)
