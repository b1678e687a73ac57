"""Chapter 12, performance: the linear drive's mechanics, amplifier, friction, response, present and shaped loop."""

from functools import cache

import numpy as np

from rtctl.design import check, feedforward, mechanics, response, shaping
from rtctl.identify import bench, best_linear, driver_curve, experiment, model_fit, sensitivity
from rtctl.identify import friction as fr
from rtctl.identify.driver_curve import DriverCurve
from rtctl.identify.friction import Point
from rtctl.identify.records import Record, take
from rtctl.laws import sections
from rtctl.laws.sections import SectionsSettings
from rtctl.loop import fused
from rtctl.reproduce.chapter10 import PRESENT_LAW
from rtctl.reproduce.played import config, crossover
from rtctl.reproduce.rows import Row, under

L_S, L_T, L_C = 1.0e-3, 2.0e-3, 1.0e-2  # m, lengths of motor shaft, wheel and capstan (appendix F)
ACTS = 3.0  # dB, least depth of an effective notch
LISTED = (("resonance_1", 114.0, 239.0), ("anti_resonance", 254.0, 919.0), ("resonance_2", 286.0, 951.0),
          ("resonance_3", 2100.0, 3261.0))  # fmt: skip
SPEEDS = (2.0, 6.0, 12.0, 18.0)  # rad/s of the capstan
RMS = {"present": 0.3, "shaped": 0.6}  # V, rms of the multisine in closed loop
TOP = 150.0  # Hz, top of the multisine; a wider band leaves less rms for each line
PRINT = {"reference": {"steps": [{"at": 0.5, "to": 1e-3 / 12}, {"at": 1.0, "to": 2e-3 / 12}]}}

DRAWN = "k_s = 4.2 and k_c = 7.6 Nm/rad and M = 1.25 kg, from these four frequencies"
LISTS = {
    "resonance_1": "and thus this system introduces also a resonance, here at  $f = 114$  [Hz]",
    "anti_resonance": "this system introduces an anti-resonance at  $f = 254$  [Hz]",
    "resonance_2": "and a resonance at  $f = 286$  [Hz]",
    "resonance_3": r"thus this system introduces a resonance, at  $f = 2.1 \cdot 10^3$  [Hz]",
}
HEADS = "the text has several damped resonances from 50 to 220 Hz, as of its print heads; this set has one"
MEASURING = "PD 1e3 (1 + 0.1 s) V/m, 5 mm/s"
RADII = (
    r"the capstan radius should be increased to  $R_c = 6.2 \cdot 10^{-3}$  [m] and the transmission wheel radius "
    r"should be decreased to  $R_t = 23 \cdot 10^{-3}$  [m]"
)
BARS = "(F.12) to (F.14) with the listed radii, lengths, G and rho"
TORQUE = "a motor torque of 15 mNm, from the 125 N"
PRESENT_GAINS = "6400 V/m, 4 s and 172 Vs/m, from 8 Hz and 2 dB; the text prints no gains"
LIMITS = "11 dB and 60 deg, limits of the optimisation"
WITH_NOTCHES = "The obtained bandwidth is 52 [Hz], with a gain margin of 11 [dB] and a phase margin of 60 [deg]"
SHAPED_LAW = "lead-lag, one notch that acts, low-pass"

MODES = under(
    *(Row(f"12.{name}", f"{name.replace('_', ' ')} of the set `figure_12_2`", "12.1, figure 12.2", hertz, "Hz", 0.03,
          quote=LISTS[name], set="figure_12_2", chosen=DRAWN)
      for name, hertz, _ in LISTED),
    *(Row(f"12.{name}_listed", f"{name.replace('_', ' ')} with the values of appendix F", "12.1, appendix F", hertz,
          "Hz",
          0.01, quote=LISTS[name], set="appendix_f", expected=listed,
          erratum=f"the listed k_s, k_c and M give {listed:g} Hz")
      for name, hertz, listed in LISTED),
    Row("12.k_s", "stiffness of the motor shaft by (F.12)", "Appendix F, (F.12)", 10.0, "Nm/rad", 0.01,
        quote="$k_s$	1.0e1	torsion spring constant motor shaft", expected=557.0,
        erratum="the listed R_s, l_s and G give 557 Nm/rad", remark=BARS),
    Row("12.k_c", "stiffness of the capstan by (F.12)", "Appendix F, (F.12)", 100.0, "Nm/rad", 0.01,
        quote="$k_c$	1.0e2	torsion spring constant capstan", expected=891.0,
        erratum="the listed R_c, l_c and G give 891 Nm/rad", remark=BARS),
    Row("12.J_c", "inertia of the capstan by (F.13), (F.14)", "Appendix F, (F.13)", 0.1, "mg m^2", 0.01,
        quote="$J_c$	1.0e-7	inertia capstan", expected=0.00999,
        erratum="the listed R_c, l_c and rho give 1.0e-8 kg m^2, a factor of 10", remark=BARS),
    Row("12.J_t", "inertia of the transmission wheel by (F.13), (F.14)", "Appendix F, (F.13)", 10.0, "mg m^2", 0.01,
        quote="$J_t$	1.0e-5	inertia transmission wheel", expected=19.98,
        erratum="the listed R_t, l_t and rho give 2.0e-5 kg m^2, a factor of 2", remark=BARS),
    set="appendix_f",
)  # fmt: skip
AMPLIFIER = under(
    Row("12.least_current", "motor current below 0.8 V", "12.2, (12.3), figure 12.3", 42.0, "mA", 0.01,
        quote=r"the current is  $4.2 \cdot 10^{-2}$  [A]"),
    Row("12.least_torque", "torque of that", "12.2", 0.88, "mNm", 0.01,
        quote=r"which is equal to  $\tau_m = 8.8 \cdot 10^{-4}$  [Nm]"),
    Row("12.knee", "voltage at which the linear part begins", "12.2, (12.3)", 0.8, "V", 0.01,
        quote=r"For  $0.8 \leq V_i \leq 3.0$  [V], the relation could be approximated by a linear relation"),
    Row("12.amplifier_gain", "slope of the linear part", "12.2, (12.3)", 0.1, "A/V", 0.01,
        quote="0.042 + 0.1(V_i - 0.8)"),
    Row("12.current_at_3", "current at 3.0 V", "12.2", 230.0, "mA", 0.01,
        quote="At  $V_i = 3.0$  [V], the maximum current of 0.23 [A] is thus reached",
        erratum="(12.3) gives 262 mA", expected=262.0),
    Row("12.torque_at_3", "torque of that", "12.2", 4.8, "mNm", 0.01,
        quote=r"which corresponds to  $\tau_m = 4.8 \cdot 10^{-3}$  [Nm]",
        erratum="follows from `12.current_at_3`", expected=5.5),
    law="constant voltages, motor held", set="figure_12_2, amplifier (12.3)",
)  # fmt: skip
RESPONSE = under(
    Row("12.averages", "windows of 4.096 s averaged", "12.3", 50.0, "", bound="at least",
        quote="averaging 50 time series of 8192 samples"),
    Row("12.excitation", "largest |u| with the noise of 0.25 V rms", "12.3", 3.0, "V", bound="at most",
        quote="if  $V_i$  exceeds 3 [V]"),
    Row("12.open_loop_bandwidth", "bandwidth of the loop of the measurement, |L| = 1", "12.3", 2.0, "Hz", 0.05,
        quote=r"$H_c = 1 \cdot 10^3(1 + 0.1s)$ , obtaining a open loop bandwidth of 2 [Hz]", expected=5.0,
        erratum="1e3 (1 + 0.1 s) gives 5 Hz with the model; 2.7 Hz is sqrt(k K_p) / 2 pi",
        remark="4.6 Hz with the set appendix_f"),
    Row("12.process_gain", "process gain at 1 Hz, as the model", "12.3", None, "m/s^2/A", 0.03,
        quote="the system behaves as a mass-damper system, with a gain similar to the derived model",
        expected=2.969, remark="no number in the text; N K_m R_c / J of the same set, M = 1.25 kg. 2.75 with the 5 kg "
        "of appendix F"),
    law=MEASURING, set="figure_12_2", filter="derivative 1000 Hz",
)  # fmt: skip
MECHANICS = under(
    Row("12.radii_gain", "gain won by R_c = 6.2 and R_t = 23 mm", "12.4", 4.0, "dB", 0.5, relative=False,
        quote="The increase of the process gain at low frequencies is 4 [dB]",
        remark="whole decibels in the text; J ~ R^4. 7.3 dB with the set figure_12_2"),
    Row("12.radii_optimum", "gain of the best radii", "12.4", 4.0, "dB", 0.5, relative=False,
        quote="The increase of the process gain at low frequencies is 4 [dB]", remark="likewise"),
    Row("12.optimum_R_c", "best radius of the capstan", "12.4", 6.2, "mm", 0.05, quote=RADII,
        differs="5.7 mm; the optimum is flat: 0.05 dB from the optimum of the text"),
    Row("12.optimum_R_t", "best radius of the wheel", "12.4", 23.0, "mm", 0.05, quote=RADII,
        differs="19.2 mm; the optimum is flat: 0.05 dB from the optimum of the text"),
    Row("12.slip_wheel", "motor torque at which the motor shaft slips on the wheel", "12.5", 14.0, "mNm", 0.05,
        quote=r"$\tau_{max} = 14$  [mNm]"),
    Row("12.slip_strip", "motor torque at which the capstan slips on the strip", "12.5", 2.5, "mNm", 0.05,
        quote=r"$\tau_{max} = 2.5$  [mNm]", remark="0.8 x 20 N x 3 mm / 20 is 2.4 mNm"),
    Row("12.normal_force", "normal force without slip, present radii", "12.5", 125.0, "N", 0.03,
        quote=r"For the present design this means that  $F_N \geq 125$  [N]", chosen=TORQUE,
        remark="117 N at most with the 14 mNm that section 12.5 calls more than the continuous torque of the motor"),
    Row("12.normal_force_optimum", "normal force without slip, R_c = 6.2 and R_t = 23 mm", "12.5", 46.0, "N", 0.03,
        quote=r"the pressure force can be reduced to  $F_N \geq 46$  [N]", chosen=TORQUE),
    set="appendix_f",
)  # fmt: skip
NOTCH = under(
    Row("12.notch", "gain of a notch with zeta_z = 0.1 and zeta_p = 0.5 at its frequency", "12.7, (12.5)", 1.1 / 1.5,
        "", 0.01, quote=r"the gain is  $|H_n| = \frac{(1+\zeta_z)}{(1+\zeta_p)}$", expected=0.2,
        erratum="(1 + zeta_z) / (1 + zeta_p) in the text; H_n gives zeta_z / zeta_p, as its next sentence",
        remark="both dampings are chosen here"),
    law="notch of the tick, 100 Hz",
)  # fmt: skip
FRICTION = under(
    Row("12.break_away_forward", "break-away forwards", "12.6", 0.93, "V", 0.01,
        quote="a static friction level of  $F_s = 0.93$  [V] for positive direction",
        chosen="F_c = 7.35 N and the cable chain in the emulator, from 0.93 and 0.88 V"),
    Row("12.break_away_backward", "break-away backwards", "12.6", 0.88, "V", 0.01,
        quote="$F_s = 0.88$  [V] for negative direction",
        chosen="F_c = 7.35 N and the cable chain in the emulator, from 0.93 and 0.88 V"),
    Row("12.friction_fall", "break-away over friction at constant speed: no decrease", "12.6", None, "", 0.02,
        quote="The constant velocity experiments do not show a decrease in friction force for small velocities",
        law=PRESENT_LAW, filter="velocity 200 Hz", expected=1.0, remark="no number in the text"),
    law="slow ramp of the reference, soft proportional law", set="figure_12_2, the error chain of ldu_printer",
)  # fmt: skip
PRESENT = under(
    Row("12.present_bandwidth", "bandwidth of the running present loop", "12.7, figure 12.8", 8.0, "Hz", 0.06,
        quote="The system bandwidth is approximately 8 [Hz]", chosen=PRESENT_GAINS),
    Row("12.present_gain_margin", "its gain margin", "12.7, figure 12.8", 2.0, "dB", 0.3, relative=False,
        quote="The obtained gain margin is only 2 [dB]", chosen=PRESENT_GAINS, remark="whole decibels in the text"),
    law=PRESENT_LAW, set="figure_12_2", filter="velocity 200 Hz",
)  # fmt: skip
SHAPED = under(
    Row("12.bandwidth", "bandwidth with lead-lag, notch and low-pass, on the measured response",
        "12.7, figure 12.9", 52.0, "Hz", 0.05, quote=WITH_NOTCHES,
        remark=f"the largest bandwidth with these margins; {HEADS}"),
    Row("12.gain_margin", "its gain margin", "12.7, figure 12.9", 11.0, "dB", bound="at least", quote=WITH_NOTCHES,
        chosen=LIMITS),
    Row("12.phase_margin", "its phase margin", "12.7, figure 12.9", 60.0, "deg", bound="at least", quote=WITH_NOTCHES,
        chosen=LIMITS),
    Row("12.notches", "notches that reduce the gain by 3 dB or more", "12.7, figure 12.9", 2.0, "",
        quote="a bode plot of a lead-lag controller with two notches",
        differs="the second notch, at 235 Hz, reduces the gain by 0.3 dB: " + HEADS),
    Row("12.bandwidth_running", "bandwidth of the running loop with lead-lag, notch and low-pass", "12.7", 50.0, "Hz",
        0.03, bound="at least",
        quote="a closed loop bandwidth of 50 [Hz] can be easily obtained",
        remark="read where |T| first falls below -3 dB, with lines up to 150 Hz: with more lines each is weaker, and "
        "noise moves the first one below -3 dB to a lower frequency; 49.7 to 51.1 Hz on processors that round "
        "differently"),
    Row("12.gain_margin_running", "its gain margin", "12.7, figure 12.9", 11.0, "dB", 0.5, relative=False,
        bound="at least", quote=WITH_NOTCHES, chosen=LIMITS,
        remark="a count of the encoder is 0.3 dB at the frequency of the margin"),
    Row("12.phase_margin_running", "its phase margin", "12.7, figure 12.9", 60.0, "deg", 1.5, relative=False,
        bound="at least", quote=WITH_NOTCHES, chosen=LIMITS, remark="likewise"),
    law=SHAPED_LAW, set="figure_12_2", filter="low-pass 2 kHz",
) + under(
    Row("12.feedforward", "tracking error of printing steps, with feedforward over without", "12.7, figure 12.10",
        None, "", bound="at most", expected=1.0,
        quote="To further optimize the performance, in addition to feedback a feedforward controller",
        remark="no number in the text"),
    law=PRESENT_LAW + ", shaper 60 rad/s", set="figure_12_2", filter="velocity 200 Hz",
)  # fmt: skip


def modes(short: bool) -> dict[str, float]:
    """Rows of the undamped modes of both parameter sets."""
    values: dict[str, float] = {}
    for name, end in (("figure_12_2", ""), ("appendix_f", "_listed")):
        found = mechanics.modes(mechanics.named(name))
        values |= {f"12.resonance_{i + 1}{end}": f for i, f in enumerate(found.resonances)}
        values[f"12.anti_resonance{end}"] = found.anti_resonances[0]
    p = mechanics.named()
    return values | {
        "12.k_s": mechanics.torsion_stiffness(p.R_s, L_S),
        "12.k_c": mechanics.torsion_stiffness(p.R_c, L_C),
        "12.J_c": 1e6 * mechanics.disc_inertia(p.R_c, L_C),
        "12.J_t": 1e6 * mechanics.disc_inertia(p.R_t, L_T),
    }


@cache
def curve() -> DriverCurve:
    """Characteristic of the printer's amplifier, 0 to 3 V, with blocked carriage."""
    return driver_curve.driver_curve(bench.play(driver_curve.driver_config(config("ldu_printer"))))


def amplifier(short: bool) -> dict[str, float]:
    """Rows of the measured (12.3)."""
    found = curve()
    K_m = mechanics.named().K_m1
    return {
        "12.least_current": 1e3 * found.I_0,
        "12.least_torque": 1e3 * found.I_0 * K_m,
        "12.knee": found.V_k,
        "12.amplifier_gain": found.gain,
        "12.current_at_3": 1e3 * found.at_3,
        "12.torque_at_3": 1e3 * found.at_3 * K_m,
    }


@cache
def noise() -> tuple[tuple[Record, ...], sensitivity.Sensitivity]:
    """Records of the linear drive at 5 mm/s with noise of 0.25 V, and its sensitivity."""
    records = tuple(take(fused.run(one.config, one.seconds)) for one in experiment.noise(config("ldu")))
    return records, sensitivity.identify(list(records))


@cache
def response_of() -> best_linear.BestLinear:
    """Best linear approximation of the linear drive."""
    played = experiment.multisine(config("ldu"))
    return best_linear.identify([take(fused.run(one.config, one.seconds)) for one in played])


def identification(short: bool) -> dict[str, float]:
    """Rows of the identification by noise and by multisine."""
    records, found = noise()
    known = found.coherence > 0.5
    fit = model_fit.fit(response_of().frf, config("ldu"))
    return {
        "12.averages": found.averages,
        "12.excitation": max(float(np.abs(r["u"]).max()) for r in records),
        "12.open_loop_bandwidth": crossover(found.f[known], found.S[known]),
        "12.process_gain": fit.K_p.value,
    }


def wheels(short: bool) -> dict[str, float]:
    """Rows of radii and slip of the friction wheels."""
    p = mechanics.named()
    R_c, R_t = 6.2e-3, 23e-3
    best = mechanics.optimum(p)
    return {
        "12.radii_gain": mechanics.gain(p, R_c, R_t),
        "12.radii_optimum": best.gain,
        "12.optimum_R_c": 1e3 * best.R_c,
        "12.optimum_R_t": 1e3 * best.R_t,
        "12.slip_wheel": 1e3 * mechanics.slip_torque(mechanics.MOTOR_FORCE, p.R_s),
        "12.slip_strip": 1e3 * mechanics.slip_torque(mechanics.STRIP_FORCE, p.R_c, p.R_t / p.R_s),
        "12.normal_force": mechanics.normal_force(mechanics.MOTOR_TORQUE, p.R_t / p.R_s, p.R_c),
        "12.normal_force_optimum": mechanics.normal_force(mechanics.MOTOR_TORQUE, R_t / p.R_s, R_c),
    }


def notch(short: bool) -> dict[str, float]:
    """Rows of the notch of the tick at its centre frequency."""
    f, dt = 100.0, 1e-4
    section = SectionsSettings.model_validate(
        {"sections": [{"kind": "notch", "frequency": f, "zeta_z": 0.1, "zeta_p": 0.5}]}
    )
    back = np.exp(-2j * np.pi * np.array([f]) * dt)
    return {"12.notch": float(np.abs(response.biquad_response(sections.build(section, dt)[0], back))[0])}


@cache
def rubbing(short: bool) -> tuple[list[Point], list[Point]]:
    """Friction points of the printer: break-away, and constant velocities."""
    made = config("ldu_printer")
    turns = 2.0 if short else 6.0
    speeds = SPEEDS[::3] if short else SPEEDS
    moving, _ = fr.constant_velocity(bench.play(fr.velocity_config(made, speeds, turns)), turns)
    return fr.break_away(bench.play(fr.break_away_config(made, 1))), moving


def friction(short: bool) -> dict[str, float]:
    """Rows of the break-away friction in both directions, and over that of the slowest constant velocity."""
    away, moving = rubbing(short)
    forward = next(p.force for p in away if p.force > 0)
    backward = -next(p.force for p in away if p.force < 0)
    slowest = min((p for p in moving if p.v > 0), key=lambda p: p.v)
    return {
        "12.break_away_forward": forward,
        "12.break_away_backward": backward,
        "12.friction_fall": forward / slowest.force,
    }


@cache
def running(which: str) -> check.Measured:
    """Measured loop gain in closed loop, of the present or the shaped loop."""
    made = config("ldu") if which == "present" else shaping.applied(config("ldu"), shaped().law)
    return check.measure(made, rms=RMS[which], f_max=TOP)


def present(short: bool) -> dict[str, float]:
    """Rows of bandwidth and margin of the printer's present controller."""
    reached = running("present").margins
    return {"12.present_bandwidth": reached.bandwidth, "12.present_gain_margin": reached.GM}


@cache
def shaped() -> shaping.Shaped:
    """Optimised filters for the measured response, which includes hold and delay."""
    frf = response_of().frf
    return shaping.of_points(frf.f, frf.H, frf.dt, None)


def depths(made: shaping.Shaped | None = None) -> list[float]:
    """Depth in dB of each notch of a shaped loop at its frequency (12.5)."""
    notches = [section for section in (made or shaped()).law.sections if section.kind == "notch"]
    return [float(-20 * np.log10(notch.zeta_z / notch.zeta_p)) for notch in notches]


def optimised(short: bool) -> dict[str, float]:
    """Rows of the shaped loop, on its design response and measured in closed loop."""
    made, reached = shaped().margins, running("shaped").margins
    worth = feedforward.worth(config("ldu", PRINT), 1.6)
    return {
        "12.bandwidth": made.bandwidth,
        "12.gain_margin": made.GM,
        "12.phase_margin": made.PM,
        "12.notches": sum(depth >= ACTS for depth in depths()),
        "12.bandwidth_running": reached.bandwidth,
        "12.gain_margin_running": reached.GM,
        "12.phase_margin_running": reached.PM,
        "12.feedforward": worth.tracking[1] / worth.tracking[0],
    }
