"""Feedforward: inverse of the machine's model, so that feedback corrects only the remainder (figure 12.10).

    computed torque    u = x_ref'' / (x'' per V)          friction    u = sign(x_ref') F_C / (force per V)

Values for `laws/inertia_feedforward` and `laws/friction_feedforward` from the model of a config, and their effect
on the emulator. Only a share of the lowest known friction is compensated: overcompensation overshoots, since
friction no longer stops the motion at the target (8.2, 8.3).

Source: thesis 5.5, 8.4, 12.7 (figure 12.10); the rigid sums of (4.9)-(4.13) and (F.1)-(F.9).
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import set_path, set_paths
from rtctl.design import mechanics
from rtctl.drivers import ldu_amplifier
from rtctl.loop import fused
from rtctl.machines.profile import REELS
from rtctl.machines.profiles import PROFILES, profile_of
from rtctl.plants import ivu, ldu

SHARE = 0.97  # of the friction that is compensated
INERTIA = 0.9  # of the inertia


class Value(NamedTuple):
    """One setting of a law, with its reason."""

    path: str
    value: float
    reason: str


class Worth(NamedTuple):
    """A run without and with feedforward, over the time that the reference plays."""

    tracking: tuple[float, float]  # rms of ref - position, rad or m
    final: tuple[float, float]  # largest |ref - position| at rest, rad or m
    tension: tuple[float, float]  # rms of the tension's swing about its mean, N; nan where there is no tape


def design(config: Any, share: float = SHARE) -> list[Value]:
    """Feedforward values for the model of a config, `share` of its friction. Raises UserError for another machine."""
    profile = profile_of(config.kind)
    if not profile.feedforward:
        known = " and ".join(kind for kind, other in PROFILES.items() if other.feedforward)
        raise UserError(f"machine: {config.kind} has no feedforward; {known} have")
    return _reels(config, share) if profile.has(REELS) else _carriage(config, share)


def applied(config: Any, values: list[Value]) -> Any:
    """The config with these values."""
    return set_paths(config, {value.path: value.value for value in values})


def without(config: Any) -> Any:
    """The config with every feedforward switched off."""
    return set_paths(config, dict.fromkeys(profile_of(config.kind).feedforward, 0.0))


def computed_torque(config: Any) -> float:
    """Volts per m/s^2 of the carriage at low frequencies, the gain of a computed torque for the linear drive."""
    p = ldu.parameters(config.plant)
    return 1.0 / (mechanics.acceleration(p) * ldu_amplifier.AMPERE_PER_VOLT)


def worth(config: Any, seconds: float, values: list[Value] | None = None) -> Worth:
    """Errors of a config without and with feedforward on the emulator, played fused for `seconds`.

    Raises NoAnswer where a run trips, or the reference never stands still.
    """
    with_it = applied(config, design(config) if values is None else values)
    runs = [_played(each, seconds) for each in (without(config), with_it)]
    tracking, final, tension = zip(*runs, strict=True)
    return Worth(tracking, final, tension)


def _played(config: Any, seconds: float) -> tuple[float, float, float]:
    config = set_path(config, "loop.mode", "fused")
    run = fused.run(config, seconds)
    if run.tripped:
        raise NoAnswer(f"the run tripped ({run.tripped}) at {run.trip_time:.3g} s")
    rows = run.between(0.0, seconds)
    error = rows[profile_of(config.kind).error]
    still = _rests(rows["target"], round(0.2 * config.loop.rate))
    if not still.size:
        raise NoAnswer("the reference never rests long enough to tell a final error; take one with steps")
    swing = float("nan")
    if profile_of(config.kind).has(REELS):
        swing = float(np.sqrt(np.mean([np.var(rows[name]) for name in ("truth_tension1", "truth_tension2")])))
    return float(np.sqrt(np.mean(error**2))), float(np.abs(error[still]).max()), swing


def _rests(target: np.ndarray, few: int) -> np.ndarray:
    """Last rows of each rest after a move, before the next change of the reference or the end."""
    changes = np.flatnonzero(np.diff(target) != 0)
    if not changes.size:
        return changes
    ends = np.append(changes, len(target) - 1)
    return ends[1:][np.diff(ends) > few]


def _reels(config: Any, share: float) -> list[Value]:
    p = ivu.parameters(config.plant)
    J = (p.J_m1 + p.J_m2 + float(p.J_1 or 0.0) + float(p.J_2 or 0.0)) / 2
    return [
        Value(
            "law.friction.motor1.tau_C",
            _rounded(share * p.tau_F1),
            f"{share:g} of the {1e3 * p.tau_F1:.3g} mNm of motor 1 (8.4)",
        ),
        Value(
            "law.friction.motor2.tau_C",
            _rounded(share * p.tau_F2),
            f"{share:g} of the {1e3 * p.tau_F2:.3g} mNm of motor 2 (8.4)",
        ),
        Value("law.inertia.J", _rounded(J), "mean inertia of a motor with its reel, (4.1) and appendix A"),
        Value("law.inertia.share", INERTIA, "computed torque of the reels (figure 12.10), a tenth left to the tape"),
    ]


def _carriage(config: Any, share: float) -> list[Value]:
    p = ldu.parameters(config.plant)
    force = p.R_t / p.R_s * p.K_m1 * ldu_amplifier.AMPERE_PER_VOLT / p.R_c
    return [
        Value("law.friction.newton_per_volt", _rounded(force), "N K_m1 0.1 A/V / R_c (12.3)"),
        Value("law.friction.F_c", _rounded(share * p.F_c), f"{share:g} of the {p.F_c:g} N of the carriage (12.6)"),
        Value(
            "law.inertia.volts",
            _rounded(INERTIA * computed_torque(config)),
            "computed torque of all that moves (figure 12.10), a tenth left to the feedback",
        ),
    ]


def _rounded(x: float) -> float:
    """To four digits, for a config that people read."""
    return float(f"{x:.4g}")
