"""Effects of sensors: scale error, error over a turn, missed counts, lag, readings without sign."""

import math

import numpy as np

from rtctl.proof.machines.draft import TWO
from rtctl.proof.machines.effect import Setup, Sizes, UnfitError, about, effect, form, on_body, sign, span
from rtctl.proof.machines.kinematics import rotary


def _positions(s: Setup) -> list[str]:
    return on_body(s, "position")


def _readings(s: Setup) -> list[str]:
    return on_body(s, "position", "speed")


def _counters(s: Setup) -> list[str]:
    return [n for n in _positions(s) if "counts_per_unit" in s.machine["sensors"][n]]


def _turning(s: Setup) -> list[str]:
    return [n for n in _readings(s) if rotary(s.machine, s.machine["sensors"][n]["body"])]


def _second(s: Setup) -> list[str]:
    found = _positions(s)
    return found if len(found) > 1 else []


@effect("sensor.scale", _second, ("position",), TWO)
def scale(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Scale error: a constant factor in one of two readings."""
    a = sign(rng) * about(rng, 0.012) * size
    s.m["s_rel"][s.sensor(node)] = 1.0 + a
    return {"relative": a}


@effect("ripple.encoder", _turning, ("angle", "position"))
def ripple(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Periodic reading error over a turn: first harmonic, or three harmonics."""
    k, sensor = s.sensor(node), s.machine["sensors"][node]
    wide = span(s, sensor["body"])
    n = 1.0 if wide > 7.0 else float(math.ceil(9.0 / max(wide, 1e-9)))
    if n > 40.0:
        raise UnfitError("the body hardly turns")
    counts = about(rng, 12.0)
    if sensor["measures"] == "speed":
        fast = float(np.quantile(np.abs(s.seen["v"][:, s.body(sensor["body"])]), 0.5))
        A = counts / (float(s.m["s_gain"][k]) * max(fast, 1e-9) * n)
    else:
        A = max(counts / float(s.m["s_gain"][k]), about(rng, 2e-3) / n)
    A *= size
    for h in range(1 + 2 * form(rng, 2)):
        s.m["s_rip"][k, h], s.m["s_ripn"][k, h] = A * 0.4**h, n * (h + 1)
        s.m["s_ripa"][k, h] = rng.uniform(0.0, 2.0 * math.pi)
    return {"amplitude_rad": A, "per_turn": n}


@effect("sensor.missed_counts", _counters, ("time", "velocity"))
def missed(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Single events of lost counts: lost and gained, or only lost."""
    k = s.sensor(node)
    counts = float(max(round(about(rng, 25.0) * math.sqrt(size)), 4))
    s.hidden.lost[k], s.hidden.lost_rate[k] = counts, about(rng, 6.0 / (s.n * s.Ts))
    s.hidden.lost_both = bool(form(rng, 2))
    return {"counts": counts, "rate": float(s.hidden.lost_rate[k])}


@effect("sensor.lag", _readings, ("frequency", "time"))
def lag(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Lag of the reading: first order, or two in series."""
    k, sensor = s.sensor(node), s.machine["sensors"][node]
    tau = about(rng, 0.02 if sensor["measures"] == "speed" else 6e-3) * size
    if form(rng, 2):
        s.m["s_lag"][k] = tau
    else:
        s.m["s_lag"][k], s.m["s_lag2"][k] = 0.6 * tau, 0.4 * tau
    return {"tau_s": tau}


def _not_in_the_loop(s: Setup) -> list[str]:
    return [n for n in _readings(s) if s.open_loop or n != s.control]


@effect("sensor.rectified", _not_in_the_loop, ("velocity", "position"), TWO)
def rectified(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Rectified reading: a counter that counts up in both directions, or a speed without sign."""
    k, sensor = s.sensor(node), s.machine["sensors"][node]
    if sensor["measures"] == "position" and "counts_per_unit" not in sensor:
        raise UnfitError("a number of a position has a sign")
    v = s.seen["v"][:, s.body(sensor["body"])]
    if min(np.mean(v > 0.0), np.mean(v < 0.0)) < 0.05:
        raise UnfitError("turns one way only")
    s.m["s_rect"][k] = 1.0
    return {}
