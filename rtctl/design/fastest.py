"""Law with the highest crossover among candidates that keeps its margins, for the designs of described machines.

A law holds where the sampled loop keeps gain and phase margin, every closed-loop pole lies inside the unit circle,
and one step of the sensor changes the command by less than GRAIN of its limit.
"""

from collections.abc import Iterable
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.design import margins, response, systems
from rtctl.design.margins import Margins
from rtctl.machines.described_parts import Parts, parts_of

ROOM = (2.0, 8.0)  # dB and degrees beyond the least margins, a reserve for small errors of the model
GRAIN = 0.2  # largest change of the command by one step of the sensor, as a share of the limit

Law = TypeVar("Law")


class Held(NamedTuple, Generic[Law]):
    """A law that holds, with its crossover and margins."""

    law: Law
    crossover: float  # Hz
    margins: Margins


class Machine(NamedTuple):
    """Response of a machine behind its hold, on a grid that is fine around its resonances."""

    start: response.Loop
    f: np.ndarray  # (n,) Hz
    P: np.ndarray  # (n,) complex


def machine_of(config: Any, start: response.Loop) -> Machine:
    """The machine of a config, whatever its law."""
    rate = config.loop.rate
    f = np.unique(np.concatenate([np.geomspace(margins.LOW / 5, margins.HIGH * rate, 1000), near(start, rate)]))
    return Machine(start, f, response.plant_response(start.model, f) * response.hold(start, f))


def fastest(
    config: Any, machine: Machine, laws: Iterable[tuple[float, Law, response.Loop]], least: tuple[float, float],
    room: tuple[float, float],
) -> Held[Law] | str:  # fmt: skip
    """The first of `laws` (crossover in Hz, law, loop with it) that holds with `least` and `room` dB and degrees; a
    sentence on the nearest miss, empty where none was near, if there is none."""
    parts = parts_of(config)
    best: tuple[float, str] | None = None  # dB or degrees beyond its least
    for crossover, law, loop in laws:
        if grain(config, loop, parts) > GRAIN:
            continue
        L, forward = (machine.P * response.law_response(loop, machine.f, path) for path in ("feedback", "reference"))
        try:
            found = margins.points(machine.f, L, forward)
        except NoAnswer:
            continue
        short = min(abs(found.GM) - least[0] - room[0], abs(found.PM) - least[1] - room[1])
        if short >= 0 and inside(loop):
            return Held(law, crossover, found._replace(stable=True))
        if best is None or short > best[0]:
            best = short, f"at {crossover:.3g} Hz it would have {found.GM:.1f} dB and {found.PM:.0f} degrees"
    return f"; {best[1]}" if best is not None else ""


def grain(config: Any, loop: response.Loop, parts: Parts) -> float:
    """Change of the command by one step of the sensor, as a share of the limit."""
    sensor = parts.machine.sensors[parts.feedback]
    quick = abs(response.law_response(loop, np.array([0.45 / loop.dt]))[0])
    return float(quick * sensor.grain / abs(sensor.scale) / config.law.limit.high)


def near(parts: response.Loop, rate: float) -> np.ndarray:
    """Frequencies around every resonance of the plant, where the response changes fast."""
    values = np.linalg.eigvals(parts.model.A)
    swinging = values[values.imag > 0]
    grid = [abs(s) / (2 * np.pi) * (1 + max(-s.real / abs(s), 1e-4) * np.linspace(-8, 8, 65)) for s in swinging]
    every = np.concatenate([*grid, [1.0]])
    return every[(every > margins.LOW) & (every < margins.HIGH * rate)]


def inside(loop: response.Loop) -> bool:
    """Whether every pole of the closed loop lies inside the unit circle, also for an unstable machine."""
    import control  # slow to import

    model = loop.model
    closed = control.feedback(systems.plant_system(model, loop.dt, loop.delay) * systems.law_system(loop), 1)
    poles = closed.poles()
    rows = np.vstack([model.A, model.c[None, :]])
    rows = rows / np.maximum(np.abs(rows).max(axis=1, keepdims=True), 1e-300)
    unseen = len(model.A) - np.linalg.matrix_rank(rows)  # positions behind a sensor of speed: they may go anywhere
    poles = poles[np.argsort(np.abs(poles - 1))][unseen:]
    return bool(np.abs(poles).max() < 1 - 1e-9)
