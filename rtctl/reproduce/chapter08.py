"""Chapter 8, test results: the reel unit identified, its friction, its loop, its steps (figures 8.2 to 8.6)."""

from functools import cache
from typing import Any

import numpy as np

from rtctl.design import check, margins, pd, robustness
from rtctl.identify import bench, best_linear, experiment, model_fit, reel_radius, sensitivity, steps
from rtctl.identify import friction as fr
from rtctl.identify.records import Record, take
from rtctl.laws import pd as law
from rtctl.loop import fused
from rtctl.plants import ivu
from rtctl.reproduce.chapter05 import AMPERE_PER_VOLT
from rtctl.reproduce.played import config, crossover, reels
from rtctl.reproduce.rows import Row

W_N = 4 * np.pi  # rad/s (8.2)
BELIEVED = {"J_m": 1.5e-3, "c": 450.0, "k": 12.5, "c_m": 12.0, "k_m": 1.3e-2}
ASKED = ("c", "c_m", "k_m", "J_m")  # of an unknown machine, beside K_p
REELS = ((0.038, 0.022), (0.022, 0.038), (0.031, 0.031))  # m, three pairs that tell the frictions apart
NOISE_RMS = 0.7  # V, with which u keeps within 5 V beside what tension and friction take
LOOP_RMS = 2.0  # V, so much that a count of the encoder, 1.6 V through tau_d, does not matter
TAU_C, UNDER = 2.4e-3, 1.5e-3  # Nm, compensated in figure 8.6 (a) and (b)

IDENTIFIED = (
    Row("8.process_gain", "process gain at 1 Hz, 38/22 mm", "8.2", 25.4, "rad/s^2/A", 0.03),
    Row("8.c", "spring constant of the paper", "appendix A", 450.0, "N/m", 0.05),
    Row("8.k", "damping of the paper", "appendix A", 12.5, "Ns/m", 0.05),
    Row("8.c_m", "spring constant of a motor shaft", "appendix A", 12.0, "Nm/rad", 0.05),
    Row("8.k_m", "damping of a motor shaft", "appendix A", 13.0, "mNms/rad", 0.05),
    Row("8.J_m", "inertia of a motor", "appendix A", 1.5, "g m^2", 0.05),
    Row("8.J_1", "inertia of reel 1 at the measured radius", "(4.1), appendix A", 0.19, "g m^2", 0.03),
    Row("8.J_2", "inertia of reel 2 at the measured radius", "(4.2), appendix A", 8.2e-3, "g m^2", 0.05),
    Row("8.R_c", "radius of the capstan", "appendix A", 1.25, "mm", 0.01,
        erratum="a typing error, 12.5 mm", expected=12.5),
    Row("8.delay", "delay in the loop", "(8.2)", 3.0, "ms", 0.03),
    Row("8.mode_tape", "mode of tape and reels in the fit, where the gain rises", "8.1, figure 8.3", 2.0, "Hz", 0.03,
        erratum="the identified set has it at 2.6 Hz", expected=2.55),
    Row("8.mode_shaft", "damped mode of the shaft in the fit", "8.1, figure 8.3", 40.0, "Hz", 0.03,
        erratum="the identified set has it at 41.6 Hz", expected=41.6),
)  # fmt: skip
NOISE = (
    Row("8.averages", "windows of 2048 samples averaged", "8.1", 50.0, "", bound="at least"),
    Row("8.excitation", "largest |u| with the noise", "8.1", 5.0, "V", bound="at most"),
    Row("8.bandwidth", "bandwidth with the law of the measurement, |L| = 1", "8.1, figure 8.2", 1.0, "Hz", 0.15,
        remark="approximately 1 Hz in the text. P = 1 V/rad and D = 0.1 Vs/rad taken per ampere; as printed, with the "
        "driver's 0.2 A/V, the equations give 0.4 Hz"),
    Row("8.process_gain_noise", "process gain at 1 Hz by the noise", "8.1, 8.2", 25.4, "rad/s^2/A", 0.05),
)  # fmt: skip
UNKNOWN = (
    Row("8.unknown", "largest error of K_p, c, c_m, k_m, J_m on machines up to 30 % off", "8.1", None, "%",
        bound="at most", expected=5.0, remark="no number in the text; 5 % is our own demand"),
    Row("8.unknown_inside", "share of these that lie in their 95 % interval", "8.1", None, "%", bound="at least",
        expected=95.0, remark="no number in the text"),
)  # fmt: skip
FRICTION = (
    Row("8.friction", "dry friction of motor 1", "(8.4), appendix A", 2.4, "mNm", 0.03),
    Row("8.friction_2", "dry friction of motor 2 over that of motor 1: slightly higher", "8.1", None, "",
        bound="at least", expected=1.0, remark="no number in the text"),
    Row("8.friction_speed", "change of friction from 0.15 to 4 rad/s: a very small dependence on velocity", "8.2", None,
        "%", bound="at most", expected=5.0, remark="no number in the text; 5 % is taken for very small"),
)  # fmt: skip
LOOP = (
    Row("8.gain", "G for 4 pi rad/s and zeta = 1 by the measured process gain", "8.2, (5.4)", 6.2, "A/rad", 0.03),
    Row("8.tau_d", "derivative time for it", "8.2, (5.4)", 0.16, "s", 0.01),
    Row("8.gain_margin", "gain margin at 38/22 mm, by a multisine in the running loop", "8.2, figure 8.5", 6.0, "dB",
        1.0, relative=False, remark="whole decibels in the text; its equations give 5.2 dB"),
    Row("8.phase_margin", "phase margin at 38/22 mm, likewise", "8.2, figure 8.5", 70.0, "deg", 4.0, relative=False,
        remark="the equations give 72 deg"),
)  # fmt: skip
RADII = tuple(
    Row(f"8.gain_margin_{name}", f"gain margin at {name.replace('_', '/')} mm", "5.2, 8.3", 6.0, "dB", off,
        relative=False,
        erratum=f"stable for all radii with 6 dB, but the equations give {value} dB here",
        expected=value)
    for name, value, off in (("40_40", 1.2, 0.1), ("40_20", 3.7, 0.1), ("20_20", 20.9, 0.15))
)  # fmt: skip
STEPS = (
    Row("8.step_error_1", "error after the step of -1 rad, 25/35 mm", "8.3, figure 8.6(a)", 9.77, "mrad",
        bound="at most", remark="the emulator's friction is the same at any angle, a plastic gear's is not"),
    Row("8.step_error_2", "error after the step of +1 rad", "8.3, figure 8.6(a)", 10.6, "mrad", bound="at most",
        remark="with the shipped law, which filters its derivative; figure 8.6 has the law as printed too, whose error "
        "here is larger than that of the text"),
    Row("8.accuracy", "accuracy of positioning, ten times that of the old unit", "8.3", 0.1, "mm",
        bound="at most"),
    Row("8.overshoot_full", "least overshoot of both steps with 2.4 mNm: there is some", "8.3, figure 8.6(a)", None,
        "%", bound="at least", expected=0.063,
        remark="no number in the text; a count of the encoder is the least to be seen"),
    Row("8.overshoot_second", "overshoot of the second step over that of the first: larger", "8.3, figure 8.6(a)", None,
        "", bound="at least", expected=1.0,
        remark="no number in the text; with the law as printed. The shipped law, which filters its derivative, has it "
        "the other way round: where the loop gain is higher, friction leaves less, and less overshoot too. As printed "
        "there is overshoot with 1.5 mNm as well: no one law does all that 8.3 says"),
    Row("8.error_second", "with 1.5 mNm, error after the second step over that after the first: smaller",
        "8.3, figure 8.6(b)", None, "", bound="at most", expected=1.0, remark="no number in the text"),
    Row("8.overshoot_under", "overshoot with 1.5 mNm: none", "figure 8.6(b)", 0.0, "%", 0.1, relative=False),
)  # fmt: skip


@cache
def multisines(short: bool) -> tuple[Record, ...]:
    """The shipped reel unit at constant speed with an odd multisine, one record a realisation."""
    played = experiment.multisine(config("ivu"))
    return tuple(take(fused.run(one.config, one.seconds)) for one in played)


@cache
def response_of(short: bool) -> best_linear.BestLinear:
    """Its best linear approximation."""
    return best_linear.identify(list(multisines(short)))


@cache
def fitted(short: bool) -> model_fit.Fit:
    """The model of chapter 4 fitted to it."""
    return model_fit.fit(response_of(short).frf, config("ivu"))


def identification(short: bool) -> dict[str, float]:
    """Parameters of the fit; inertias by the radii; modes of the fitted matrices."""
    found = fitted(short)
    p = ivu.parameters(found.settings)
    values = {name: e.value for name, e in found.parameters.items()}
    drives = [(AMPERE_PER_VOLT, 1e4, 0.7, 0.0)] * 2
    A, _ = ivu.state_space(ivu.build(found.settings, 1e-3, drives))
    swing = np.linalg.eigvals(A[: 2 * ivu.NQ, : 2 * ivu.NQ])
    modes = np.sort(np.abs(swing[swing.imag > 1e-3])) / (2 * np.pi)
    return {
        "8.process_gain": found.K_p.value,
        "8.c": values["c"],
        "8.k": values["k"],
        "8.c_m": values["c_m"],
        "8.k_m": 1e3 * values["k_m"],
        "8.J_m": 1e3 * values["J_m"],
        "8.J_1": 1e3 * float(p.J_1 or 0.0),
        "8.J_2": 1e3 * float(p.J_2 or 0.0),
        "8.R_c": 1e3 * capstan(),
        "8.delay": 1e3 * found.tau.value,
        "8.mode_tape": modes[0],
        "8.mode_shaft": modes[1],
    }


def capstan() -> float:
    """Radius of the capstan in m: (5.2) the other way round, from a reel whose radius is known."""
    made = reels(0.038, 0.022)
    record = bench.play(reel_radius.radius_config(made))
    way = reel_radius.reel_radii(record)[0]
    inside = (record.t >= way.begin) & (record.t <= way.end)
    return float(made.R_c * record["truth_R1"][inside].mean() / way.R1.R)


@cache
def noise(short: bool) -> tuple[tuple[Record, ...], sensitivity.Sensitivity]:
    """Records with band-limited noise, and the sensitivity by Welch's method with the settings of the text."""
    records = tuple(take(fused.run(one.config, one.seconds)) for one in experiment.noise(config("ivu"), rms=NOISE_RMS))
    return records, sensitivity.identify(list(records))


def by_noise(short: bool) -> dict[str, float]:
    """What the noise asks of the drive and what S says."""
    records, found = noise(short)
    fit = model_fit.fit(found.frf, config("ivu"))
    return {
        "8.averages": found.averages,
        "8.excitation": max(float(np.abs(r[name]).max()) for r in records for name in ("u1", "u2")),
        "8.bandwidth": crossover(found.f, found.S),
        "8.process_gain_noise": fit.K_p.value,
    }


def unknown(short: bool) -> dict[str, float]:
    """Machines that differ from what is believed by up to 30 %, identified from their records alone."""
    off: list[float] = []
    inside: list[bool] = []
    for seed in (2,) if short else (2, 3, 5):
        rng = np.random.default_rng(seed)
        truth = {name: value * rng.uniform(0.7, 1.3) for name, value in BELIEVED.items()}
        both = {f"plant.parameters.{name}{i}": value for name, value in truth.items() for i in (1, 2)}
        made = reels(0.038, 0.022, both)
        frf = best_linear.identify([take(fused.run(e.config, e.seconds)) for e in experiment.multisine(made)]).frf
        found = model_fit.fit(frf, config("ivu"))
        pairs = [(found.parameters[name], truth[name]) for name in ASKED]
        for one, true in [*pairs, (found.K_p, model_fit.process_gain(made, frf))]:
            off.append(abs(one.value / true - 1))
            inside.append(one.low < true < one.high)
    return {"8.unknown": 100 * max(off), "8.unknown_inside": 100 * float(np.mean(inside))}


@cache
def velocities(short: bool) -> tuple[Record, ...]:
    """Constant velocities, 12 turns of the capstan each, with three pairs of reels."""
    speeds, turns = ((0.3, 1.2, 4.0), 3.0) if short else (fr.SPEEDS["ivu"], 12.0)
    return tuple(bench.play(fr.velocity_config(reels(*R), speeds, turns)) for R in REELS)


def friction(short: bool) -> dict[str, float]:
    """Friction of both motors, and how much it changes with speed."""
    records, turns = velocities(short), 3.0 if short else 12.0
    tau = fr.split(records, turns)
    points, _ = fr.constant_velocity(records[0], turns)
    forces = [abs(p.force) for p in points]
    return {
        "8.friction": 1e3 * tau.tau_1,
        "8.friction_2": tau.tau_2 / tau.tau_1,
        "8.friction_speed": 100 * float(np.ptp(forces)) / min(forces),
    }


@cache
def designed(short: bool) -> tuple[pd.PdDesign, Any]:
    """The PD of (5.4) by the K_p of the fit, in V, and the reel unit with it, without a filter as in the text."""
    K_p = fitted(short).K_p.value * AMPERE_PER_VOLT
    found = pd.PdDesign(K_p, *law.design(K_p, W_N))
    made = pd.applied(config("ivu", {"law.position.derivative_filter": None}), found)
    return found, made


@cache
def running_loop(short: bool) -> check.Measured:
    """Loop gain of that PD, measured while it runs."""
    return check.measure(designed(short)[1], rms=LOOP_RMS, period=4.0, f_max=80.0)


def loop(short: bool) -> dict[str, float]:
    """PD and its margins."""
    found, _ = designed(short)
    reached = running_loop(short).margins
    return {
        "8.gain": found.gain * AMPERE_PER_VOLT,
        "8.tau_d": found.tau_d,
        "8.gain_margin": reached.GM,
        "8.phase_margin": reached.PM,
    }


def over_radii(short: bool) -> dict[str, float]:
    """Margins of the printed loop (8.2) at the corners of the radii."""
    corners = {"40_40": (0.04, 0.04), "40_20": (0.04, 0.02), "20_20": (0.02, 0.02)}
    made = config("ivu")
    return {f"8.gain_margin_{name}": robustness.at(made, *R, printed=True).GM for name, R in corners.items()}


@cache
def radian(tau_C: float, printed: bool = False) -> Record:
    """Figure 8.6: steps of a radian with `tau_C` Nm of friction compensated; `printed` without the filter."""
    made = config("ivu", {"law.position.derivative_filter": None} if printed else None)
    return bench.play(steps.radian_config(made, tau_C))


def errors(done: steps.Steps) -> list[float]:
    """Size of the error after each step, mrad."""
    return [1e3 * abs(float(step["final_error_rad"] or 0.0)) for step in done.each]


def overshoots(done: steps.Steps) -> list[float]:
    """Overshoot of each step, %."""
    return [float(step["overshoot_pct"] or 0.0) for step in done.each]


def radians(short: bool) -> dict[str, float]:
    """Errors and overshoot of the steps."""
    full, under = (steps.steps(radian(tau)) for tau in (TAU_C, UNDER))
    printed = steps.steps(radian(TAU_C, printed=True))
    return {
        "8.step_error_1": errors(full)[0],
        "8.step_error_2": errors(full)[1],
        "8.accuracy": abs(full.worst_mm),
        "8.overshoot_full": min(overshoots(full)),
        "8.overshoot_second": overshoots(printed)[1] / overshoots(printed)[0],
        "8.error_second": errors(under)[1] / errors(under)[0],
        "8.overshoot_under": under.overshoot_pct,
    }


def model_loop(short: bool, f: np.ndarray) -> np.ndarray:
    """Loop gain (n,) of the fitted model with that PD, hold and delay as (8.2), at `f` (n,) Hz."""
    L, _ = margins.loops(margins.response.take(designed(short)[1]), printed=True)
    return L(f)
