"""Experiments for a frequency response: constant speed to and fro, and an excitation within the machine's limits.

The reference goes half a leg back and then whole legs to and fro. The mean reel radii are then those at the start. Dry
friction acts in both directions but keeps its sign within a leg. The excitation is small enough that speed keeps its
sign and the drive is not saturated. One motor of the reel unit takes the whole command (`motor`): with the usual
allocation the motors alternate, which is not one response.

    ivu   5 V/rad and 0.5 Vs/rad, |L| = 1 at 0.9 Hz; chosen, five times the 1 V/rad and 0.1 Vs/rad of 8.1
    ldu   1e3 V/m and 0.1 s, 5 mm/s, 0.25 V rms                                                                   (12.3)

Source: thesis 8.1 and 12.3. With the printed gains |L| is 1 at 0.4 Hz, and |T| falls by 3 dB at 0.6 Hz.
"""

from math import ceil
from typing import Any, NamedTuple

from rtctl.config.errors import UserError
from rtctl.config.load import set_path, set_paths
from rtctl.identify.bench import arming
from rtctl.identify.sensitivity import AVERAGES, SETTLE, WINDOW
from rtctl.laws.excitation import MOST
from rtctl.machines.profile import REELS, Usual
from rtctl.machines.profiles import PROFILES, profile_of

PERIOD = 4.096  # s: lines 0.24 Hz apart, every other one excited
START = 0.2  # s at rest before the first leg


class Experiment(NamedTuple):
    """Config of an experiment, and its duration in s from the first tick."""

    config: Any
    seconds: float


def multisine(
    config: Any,
    realisations: int = 4,
    periods: int = 4,
    legs: int = 2,
    motor: int = 1,
    rms: float | None = None,
    speed: float | None = None,
    band: tuple[float, float] | None = None,
    period: float = PERIOD,
    keep_law: bool = False,
) -> list[Experiment]:
    """Multisine experiments for `best_linear.identify`, one for each realisation.

    Each has `legs` at constant speed of `periods` periods and one more for the transient. `rms` in V, `speed` in rad/s
    or m/s, `band` in Hz, `period` in s. `keep_law` keeps the gains. Raises UserError for amplitudes beyond the limits
    of the machine.
    """
    usual = usual_of(config)
    low, high = band or usual.band
    leg = usual.settle + (periods + 1) * period
    made = _prepared(config, usual, motor, keep_law)
    rms = usual.rms if rms is None else rms
    check_size(made, rms)
    made, seconds = _to_and_fro(made, legs, leg, usual.speed if speed is None else speed)
    wave = {"kind": "multisine", "rms": rms, "f_min": low, "f_max": high, "period": period}
    return [
        Experiment(set_path(made, "excitation", {**wave, "seed": seed}), seconds) for seed in range(1, realisations + 1)
    ]


def noise(
    config: Any,
    averages: int = AVERAGES,
    windows: int = 8,
    motor: int = 1,
    rms: float | None = None,
    speed: float | None = None,
    top: float | None = None,
    keep_law: bool = False,
) -> list[Experiment]:
    """Experiments with band-limited noise for `sensitivity.identify`: `averages` windows of 4.096 s at half overlap.

    A leg holds `windows` windows. One run serves where its noise does not repeat; else each leg is a run with another
    seed: a waveform has 65536 ticks, 131 s at 500 Hz and 6.6 s at 10 kHz. `rms` in V, `speed` in rad/s or m/s, `top`
    in Hz. Raises UserError for amplitudes beyond the limits of the machine.
    """
    usual = usual_of(config)
    rate = config.loop.rate
    rms = usual.noise_rms if rms is None else rms
    made = _prepared(config, usual, motor, keep_law)
    check_size(made, rms)
    leg = usual.settle + SETTLE + WINDOW * (windows + 1) / 2
    legs, period = ceil(averages / windows), MOST / rate
    runs = 1 if period > averages * WINDOW / 2 else legs
    made, seconds = _to_and_fro(made, legs // runs, leg, usual.speed if speed is None else speed)
    wave = {"kind": "noise", "rms": rms, "f_max": min(top or usual.noise_top, 0.49 * rate), "period": period}
    return [Experiment(set_path(made, "excitation", {**wave, "seed": seed}), seconds) for seed in range(1, runs + 1)]


def usual_of(config: Any) -> Usual:
    """Usual excitation of a kind of machine. Raises UserError for a kind without one."""
    response = profile_of(config.kind).response
    if response is None:
        known = [kind for kind, profile in PROFILES.items() if profile.response is not None]
        raise UserError(f"{config.name}: a frequency response is played on {' and '.join(known)}, not on {config.kind}")
    return response.usual


def check_size(config: Any, rms: float) -> None:
    """Raise UserError where four times `rms` V leaves the drive's linear range (8.1: 5 V; 12.2: 3 V, runaway)."""
    drive = usual_of(config).most
    most = min(config.law.limit.high, config.amplifier.limit if drive is None else drive)
    if 4 * rms > most:
        raise UserError(
            f"{config.name}: excitation of {rms:g} V rms peaks at some {4 * rms:.2g} V, the drive takes {most:g} V; "
            f"take {most / 4:.2g} V or less"
        )


def _prepared(config: Any, usual: Usual, motor: int, keep_law: bool) -> Any:
    profile = profile_of(config.kind)
    if not 1 <= motor <= len(profile.columns.written):
        raise UserError(f"{config.name}: motor {motor}: the {config.kind} has no such motor")
    config = set_paths(config, {} if keep_law else usual.law)
    if profile.has(REELS):
        config = set_path(config, "law.allocation.kind", f"motor{motor}")
        if config.safety.following_error:
            config = set_path(config, "safety.following_error", max(config.safety.following_error, 1.0))
    return config


def _to_and_fro(config: Any, legs: int, leg: float, speed: float) -> tuple[Any, float]:
    """Config and duration in s of a reference: half a leg back, then `legs` legs of `leg` s each, on ticks."""
    dt = 1.0 / config.loop.rate
    leg = ceil(leg / dt) * dt
    length = speed * leg
    steps, t, x = [], START, 0.0
    for i in range(legs + 1):
        to = length / 2 * (-1) ** (i + 1)
        steps.append({"at": round(t, 9), "to": to, "ramp": speed})
        t += abs(to - x) / speed + dt
        t, x = ceil(t / dt - 1e-6) * dt, to
    return set_path(config, "reference", {"steps": steps}), t + arming(config)
