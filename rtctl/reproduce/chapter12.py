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
from rtctl.reproduce.played import config, crossover
from rtctl.reproduce.rows import Row

LISTED = (("resonance_1", 114.0, 239.0), ("anti_resonance", 254.0, 919.0), ("resonance_2", 286.0, 951.0),
          ("resonance_3", 2100.0, 3261.0))  # fmt: skip
SPEEDS = (2.0, 6.0, 12.0, 18.0)  # rad/s of the capstan
RMS = {"present": 0.3, "shaped": 0.6}  # V, of the multisine in the running loop
TOP = 150.0  # Hz, of it; more lines would have less of it each
PRINT = {"reference": {"steps": [{"at": 0.5, "to": 1e-3 / 12}, {"at": 1.0, "to": 2e-3 / 12}]}}

MODES = (
    *(Row(f"12.{name}", f"{name.replace('_', ' ')} of the set `figure_12_2`", "12.1, figure 12.2", hertz, "Hz", 0.03,
          remark="k_s = 4.2 and k_c = 7.6 Nm/rad and M = 1.25 kg are the set with which the figure was drawn")
      for name, hertz, _ in LISTED),
    *(Row(f"12.{name}_listed", f"{name.replace('_', ' ')} with what appendix F lists", "12.1, appendix F", hertz, "Hz",
          0.01, erratum=f"the listed k_s and k_c give {listed:g} Hz", expected=listed)
      for name, hertz, listed in LISTED),
)  # fmt: skip
AMPLIFIER = (
    Row("12.least_current", "motor current below 0.8 V", "(12.3), figure 12.3", 42.0, "mA", 0.01),
    Row("12.least_torque", "torque of that", "12.2", 0.88, "mNm", 0.01),
    Row("12.knee", "voltage at which the straight part begins", "(12.3)", 0.8, "V", 0.01),
    Row("12.amplifier_gain", "slope of the straight part", "(12.3)", 0.1, "A/V", 0.01),
    Row("12.current_at_3", "current at 3.0 V", "12.2", 230.0, "mA", 0.01,
        erratum="(12.3) gives 262 mA", expected=262.0),
    Row("12.torque_at_3", "torque of that", "12.2", 4.8, "mNm", 0.01,
        erratum="follows from the row above", expected=5.5),
)  # fmt: skip
RESPONSE = (
    Row("12.averages", "windows of 4.096 s averaged", "12.3", 50.0, "", bound="at least"),
    Row("12.excitation", "largest |u| with the noise", "12.3", 3.0, "V", bound="at most"),
    Row("12.open_loop_bandwidth", "bandwidth of the loop of the measurement, |L| = 1", "12.3", 2.0, "Hz", 0.05,
        erratum="1e3 (1 + 0.1 s) gives 5 Hz with the model; 2.7 Hz is sqrt(k K_p) / 2 pi", expected=5.0),
    Row("12.process_gain", "process gain at 1 Hz, as the model", "12.3, appendix F", None, "m/s^2/A", 0.1,
        expected=2.75, remark="no number in the text; 2.75 is N K_m R_c / J with the listed M = 5 kg"),
)  # fmt: skip
MECHANICS = (
    Row("12.radii_gain", "gain won by R_c = 6.2 and R_t = 23 mm", "12.4", 4.0, "dB", 0.6, relative=False,
        remark="flat optimum; 4.0 to 4.6 dB with J ~ R^4"),
    Row("12.radii_optimum", "gain of the best radii", "12.4", 4.0, "dB", 0.6, relative=False,
        remark="at R_c = 5.7 and R_t = 19.2 mm with J ~ R^4"),
    Row("12.slip_wheel", "motor torque at which the motor slips on the wheel", "12.5", 14.0, "mNm", 0.05),
    Row("12.slip_strip", "motor torque at which the capstan slips on the strip", "12.5", 2.5, "mNm", 0.05),
    Row("12.normal_force", "normal force without slip, present radii", "12.5", 125.0, "N", 0.03),
    Row("12.normal_force_optimum", "normal force without slip, R_c = 6.2 and R_t = 23 mm", "12.5", 46.0, "N", 0.03),
)  # fmt: skip
NOTCH = (
    Row("12.notch", "gain of a notch with zeta_z = 0.1 and zeta_p = 0.5 at its frequency", "(12.5)", 0.733, "", 0.01,
        erratum="(1 + zeta_z) / (1 + zeta_p) in the text; H_n gives zeta_z / zeta_p", expected=0.2),
)  # fmt: skip
FRICTION = (
    Row("12.break_away_forward", "break-away forwards", "12.6", 0.93, "V", 0.01),
    Row("12.break_away_backward", "break-away backwards", "12.6", 0.88, "V", 0.01),
    Row("12.friction_fall", "break-away over friction at constant speed: no decrease", "12.6", None, "", 0.02,
        expected=1.0, remark="no number in the text"),
)  # fmt: skip
PRESENT = (
    Row("12.present_bandwidth", "bandwidth of the present loop while it runs", "12.7, figure 12.8", 8.0, "Hz", 0.06),
    Row("12.present_gain_margin", "its gain margin", "12.7, figure 12.8", 2.0, "dB", 0.3, relative=False,
        remark="whole decibels in the text"),
)  # fmt: skip
SHAPED = (
    Row("12.bandwidth", "bandwidth with lead-lag, two notches and low-pass, on the measured response",
        "12.7, figure 12.9", 52.0, "Hz", 0.05),
    Row("12.gain_margin", "its gain margin", "12.7, figure 12.9", 11.0, "dB", bound="at least"),
    Row("12.phase_margin", "its phase margin", "12.7, figure 12.9", 60.0, "deg", bound="at least"),
    Row("12.bandwidth_running", "bandwidth of that loop while it runs", "12.7", 50.0, "Hz", bound="at least",
        remark="read where |T| first falls below -3 dB, so with lines up to 150 Hz only: more lines have less each, "
        "and noise makes one fall too early"),
    Row("12.gain_margin_running", "its gain margin", "12.7, figure 12.9", 11.0, "dB", 0.5, relative=False,
        bound="at least", remark="a count of the encoder is 0.3 dB at the frequency where it is read"),
    Row("12.phase_margin_running", "its phase margin", "12.7, figure 12.9", 60.0, "deg", 1.5, relative=False,
        bound="at least", remark="likewise"),
    Row("12.feedforward", "tracking error of printing steps with feedforward over that without", "12.7, figure 12.10",
        None, "", bound="at most", expected=1.0, remark="no number in the text: it further optimises the performance"),
)  # fmt: skip


def modes(short: bool) -> dict[str, float]:
    """Undamped modes of both sets."""
    values: dict[str, float] = {}
    for name, end in (("figure_12_2", ""), ("appendix_f", "_listed")):
        found = mechanics.modes(mechanics.named(name))
        values |= {f"12.resonance_{i + 1}{end}": f for i, f in enumerate(found.resonances)}
        values[f"12.anti_resonance{end}"] = found.anti_resonances[0]
    return values


@cache
def curve() -> DriverCurve:
    """The amplifier of the printer, 0 to 3 V, the carriage held."""
    return driver_curve.driver_curve(bench.play(driver_curve.driver_config(config("ldu_printer"))))


def amplifier(short: bool) -> dict[str, float]:
    """(12.3) as it is measured."""
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
    """The linear drive at 5 mm/s with noise of 0.25 V, and its sensitivity."""
    records = tuple(take(fused.run(one.config, one.seconds)) for one in experiment.noise(config("ldu")))
    return records, sensitivity.identify(list(records))


@cache
def response_of() -> best_linear.BestLinear:
    """Its best linear approximation."""
    played = experiment.multisine(config("ldu"))
    return best_linear.identify([take(fused.run(one.config, one.seconds)) for one in played])


def identification(short: bool) -> dict[str, float]:
    """What noise and multisine say."""
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
    """Radii and slip of the friction wheels."""
    p = mechanics.named()
    R_c, R_t = 6.2e-3, 23e-3
    return {
        "12.radii_gain": mechanics.gain(p, R_c, R_t),
        "12.radii_optimum": mechanics.optimum(p).gain,
        "12.slip_wheel": 1e3 * mechanics.slip_torque(mechanics.MOTOR_FORCE, p.R_s),
        "12.slip_strip": 1e3 * mechanics.slip_torque(mechanics.STRIP_FORCE, p.R_c, p.R_t / p.R_s),
        "12.normal_force": mechanics.normal_force(mechanics.MOTOR_TORQUE, p.R_t / p.R_s, p.R_c),
        "12.normal_force_optimum": mechanics.normal_force(mechanics.MOTOR_TORQUE, R_t / p.R_s, R_c),
    }


def notch(short: bool) -> dict[str, float]:
    """The notch of the tick at its own frequency."""
    f, dt = 100.0, 1e-4
    section = SectionsSettings.model_validate(
        {"sections": [{"kind": "notch", "frequency": f, "zeta_z": 0.1, "zeta_p": 0.5}]}
    )
    back = np.exp(-2j * np.pi * np.array([f]) * dt)
    return {"12.notch": float(np.abs(response.biquad_response(sections.build(section, dt)[0], back))[0])}


@cache
def rubbing(short: bool) -> tuple[list[Point], list[Point]]:
    """Break-away of the printer, and its friction at constant velocities."""
    made = config("ldu_printer")
    turns = 2.0 if short else 6.0
    speeds = SPEEDS[::3] if short else SPEEDS
    moving, _ = fr.constant_velocity(bench.play(fr.velocity_config(made, speeds, turns)), turns)
    return fr.break_away(bench.play(fr.break_away_config(made, 1))), moving


def friction(short: bool) -> dict[str, float]:
    """Break-away both ways, and against the slowest constant velocity."""
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
    """Loop gain while it runs, of the present or the shaped loop."""
    made = config("ldu") if which == "present" else shaping.applied(config("ldu"), shaped().law)
    return check.measure(made, rms=RMS[which], f_max=TOP)


def present(short: bool) -> dict[str, float]:
    """Bandwidth and margin of the controller that the printer has."""
    reached = running("present").margins
    return {"12.present_bandwidth": reached.bandwidth, "12.present_gain_margin": reached.GM}


@cache
def shaped() -> shaping.Shaped:
    """Filters by optimisation on the measured response, hold and delay in it."""
    frf = response_of().frf
    return shaping.of_points(frf.f, frf.H, frf.dt, None)


def optimised(short: bool) -> dict[str, float]:
    """The shaped loop on the response it was made for, and while it runs."""
    made, reached = shaped().margins, running("shaped").margins
    worth = feedforward.worth(config("ldu", PRINT), 1.6)
    return {
        "12.bandwidth": made.bandwidth,
        "12.gain_margin": made.GM,
        "12.phase_margin": made.PM,
        "12.bandwidth_running": reached.bandwidth,
        "12.gain_margin_running": reached.GM,
        "12.phase_margin_running": reached.PM,
        "12.feedforward": worth.tracking[1] / worth.tracking[0],
    }
