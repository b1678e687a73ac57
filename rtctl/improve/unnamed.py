"""Remedies without a named effect: disturbance observer, repetitive control over a turn, integral with a dead zone."""

from typing import Any

import numpy as np

from rtctl import machines
from rtctl.improve.ground import Ground
from rtctl.improve.remedy import BASE, Remedy
from rtctl.machines.profiles import profile_of

BANDS = (1.0, 0.7, 0.5, 0.35, 0.25, 0.15)  # bandwidth of the observer in crossovers
INTEGRALS = (0.5, 0.25, 0.1)  # crossovers at which the integral meets the gain
GRAINS = 2.0  # steps of the sensor within which the integral rests
REPEATS = (1.0, 0.3)  # crossovers at which the integral of a part of the turn meets the gain
TURNS = 1.5  # turns of the reference that repetitive control needs, at least
SLOW = 0.02  # of the travel, per second, below which nothing is learned


def unnamed(g: Ground) -> list[Remedy]:
    """Remedies against the residual error, in the order in which they are tried."""
    return [made for make in (observer, repetitive, integral) if (made := make(g)) is not None]


def observer(g: Ground) -> Remedy | None:
    """Disturbance observer, the fastest that keeps the margins."""
    if g.gain is None or _gain(g) <= 0.0:
        return None
    config = g.found.config
    values: dict[str, Any] = {
        f"{BASE}.observer.acceleration": float(f"{abs(g.gain[0]):.5g}"),
        f"{BASE}.observer.share": 1.0,
        f"{BASE}.observer.delay": int(config.loop.write == "next_tick"),
    }
    if abs(g.gain[0] - g.gain[1]) > 1e-6 * abs(g.gain[0]):
        values[f"{BASE}.observer.acceleration_back"] = float(f"{abs(g.gain[1]):.5g}")
    ways = tuple({**values, f"{BASE}.observer.bandwidth": float(f"{band * _crossover(g):.3g}")} for band in BANDS)
    return Remedy("observer", "disturbance observer", _against(g), "bandwidth by the margins", ways)


def repetitive(g: Ground) -> Remedy | None:
    """Repetitive control, where the residual error may be periodic in the turn and the reference makes enough turns."""
    config = g.found.config
    turn, way = turn_of(config), g.travel[1] - g.travel[0]
    comes_back = g.found.unnamed or any(effect.term.axis == "angle" for effect in g.found.effects)
    if turn is None or way <= TURNS * turn or not comes_back or _gain(g) <= 0.0:
        return None
    values = {
        "period": turn,
        "slow": float(f"{SLOW * way:.3g}"),
        "lead": machines.build(config).dt * (0.5 + (config.loop.write == "next_tick")),
    }
    gains = (float(f"{_gain(g) * share * _crossover(g):.4g}") for share in REPEATS)
    ways = tuple({f"{BASE}.repetitive": {**values, "gain": gain}} for gain in gains)
    return Remedy("repetitive", "repetitive control over a turn", _against(g), "learns while it moves", ways)


def integral(g: Ground) -> Remedy | None:
    """Integral action for a law without one."""
    config = g.found.config
    if _gain(g) <= 0.0 or getattr(config.law.position, "tau_i", None) is not None:
        return None
    zone = GRAINS * step_of(config)
    ways = tuple(
        {
            f"{BASE}.integral.gain": float(f"{_gain(g) * share * _crossover(g):.4g}"),
            f"{BASE}.integral.dead_zone": float(f"{zone:.4g}"),
        }
        for share in INTEGRALS
    )
    size = f"rests within {zone:.3g} {machines.build(config).unit} of the reference"
    return Remedy("integral", "integral with a dead zone", _against(g), size, ways)


def _gain(g: Ground) -> float:
    return float(getattr(g.found.config.law.position, "gain", 0.0) or 0.0)


def _crossover(g: Ground) -> float:
    return g.margins.f_PM if g.margins is not None else 0.01 * float(g.found.config.loop.rate)


def _against(g: Ground) -> str:
    return "effect without a name" if g.found.unnamed else "residual error"


def turn_of(config: Any) -> float | None:
    """Travel of the reference for a turn of the measured body; None where no body turns, or for a speed."""
    machine = machines.build(config)
    if machine.unit == "rad":
        return float(2.0 * np.pi)
    return float(2.0 * np.pi * machine.radius) if machine.unit == "m" and machine.radius else None


def step_of(config: Any) -> float:
    """One step of the feedback's sensor in the unit of the reference; 0 where it is unknown."""
    profile = profile_of(config.kind)
    if profile.counts is not None:
        return 1.0 / profile.counts(config)
    from rtctl.machines.described_parts import parts_of

    parts = parts_of(config)
    sensor = parts.machine.sensors[parts.feedback]
    return float(abs(sensor.grain / sensor.scale))
