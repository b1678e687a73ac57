"""First law of a described machine: the fastest PD or PI that keeps its margins on the linear model.

    PD   K (1 + tau_d s)                     a position that needs no holding force
    PI   K (1 + 1/(tau_i s)) + K_v s         a position under weight
    PI   K (1 + 1/(tau_i s))                 a speed

The crossover is lowered until the law holds by the criteria of fastest.py.

Source: Astrom & Murray, Feedback Systems (2008), 11.3 (loop shaping by the crossover).
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.config.load import set_path
from rtctl.design import response
from rtctl.design.fastest import ROOM, Machine, fastest, machine_of
from rtctl.design.margins import Margins
from rtctl.laws import pd, pi_velocity, velocity
from rtctl.machines.described_parts import Parts, parts_of
from rtctl.plants.graph.coupled import pulled
from rtctl.plants.graph.layout import layout

CROSSOVERS = 60  # tried, evenly in the logarithm
SLOWEST, FASTEST = 1 / 4000, 1 / 12  # of the sample rate
LEADS = ((60.0, 6.0), (70.0, 6.0), (60.0, 3.0), (70.0, 3.0), (45.0, 10.0), (20.0, 10.0))  # degrees, and corner of the
# derivative's filter in units of the crossover, in the order in which they are tried
INTEGRAL = 6.0  # integral time, in units of 1 / crossover


class Numbers(NamedTuple):
    """Kind and gains of a law."""

    kind: str  # pd | pi_velocity
    gain: float  # command per unit of error
    tau_d: float  # s, 0 for none
    tau_i: float  # s, of a PI
    corner: float  # Hz, of the derivative's filter


class First(NamedTuple):
    """A law that holds, with its crossover and margins."""

    config: Any
    law: Numbers
    crossover: float  # Hz
    margins: Margins
    words: str  # why this kind


def design(config: Any, least: tuple[float, float], bandwidth: float | None = None) -> First:
    """The law with the highest crossover that keeps `least` dB and degrees; about `bandwidth` Hz where it is given.

    Raises NoAnswer where no law of the kind is stable with these margins.
    """
    parts, (kind, why) = parts_of(config), kind_for(config)
    start = response.take(set_path(config, "law.position", {"kind": "pd", "gain": 1.0}))
    machine, rate = machine_of(config, start), config.loop.rate

    def laws() -> Iterator[tuple[float, Numbers, response.Loop]]:
        wanted = np.geomspace(FASTEST * rate, SLOWEST * rate, CROSSOVERS) if bandwidth is None else [bandwidth]
        for crossover in wanted:
            for lead, filter in LEADS if not parts.is_speed else ((0.0, 1.0),):
                law = _scaled(machine, kind, float(crossover), lead, filter)
                yield float(crossover), law, _loop(start, law)

    found = fastest(config, machine, laws(), least, ROOM if bandwidth is None else (0.0, 0.0))
    if isinstance(found, str):
        raise NoAnswer(
            f"no {_named(kind, parts)} law from {parts.feedback} to {parts.drive} is stable with {least[0]:g} dB and "
            f"{least[1]:g} degrees{found}; {_advice(parts)}"
        )
    return First(applied(config, found.law, parts), found.law, found.crossover, found.margins, why)


def kind_for(config: Any) -> tuple[str, str]:
    """Kind of law for a machine, with the reason."""
    parts = parts_of(config)
    if parts.is_speed:
        return "pi_velocity", f"PI: {parts.feedback} shows a speed"
    machine = parts.machine
    swings = pulled(layout(machine), dict(machine.paths()))
    if any(body.weights for body in machine.bodies.values()) or machine.sensors[parts.feedback].body in swings:
        return "pi_velocity", "PI with velocity feedback: weight pulls, and the integral holds it"
    return "pd", f"PD: {parts.feedback} shows a position, and nothing pulls at rest"


def applied(config: Any, law: Numbers, parts: Parts) -> Any:
    """The config with this law."""
    values: dict[str, Any] = {"kind": law.kind, "gain": law.gain}
    if law.kind == "pd":
        return set_path(config, "law.position", values | {"tau_d": law.tau_d, "derivative_filter": law.corner})
    values["tau_i"] = law.tau_i
    if not parts.is_speed:
        values["velocity_gain"] = _short(law.gain * law.tau_d)
        config = set_path(config, "law.velocity.filter", law.corner)
    return set_path(config, "law.position", values)


def _loop(start: response.Loop, law: Numbers) -> response.Loop:
    """The loop with this law."""
    dt = start.dt
    if law.kind == "pd":
        made: Any = pd.build(pd.PdSettings(gain=law.gain, tau_d=law.tau_d, derivative_filter=law.corner), dt)
        return start._replace(kind="pd", blocks={**start.blocks, "position": made})
    made = pi_velocity.build(
        pi_velocity.PiVelocitySettings(gain=law.gain, tau_i=law.tau_i, velocity_gain=law.gain * law.tau_d), dt
    )
    filtered = velocity.build(velocity.VelocitySettings(filter=law.corner if law.tau_d else None), dt)
    return start._replace(kind=law.kind, blocks={**start.blocks, "position": made, "velocity": filtered})


def _scaled(machine: Machine, kind: str, crossover: float, lead: float, filter: float) -> Numbers:
    """The law that crosses at `crossover` Hz with `lead` degrees of lead."""
    start, f, P = machine
    w = 2 * np.pi * crossover
    corner = min(filter * crossover, 0.4 / start.dt)
    law = Numbers(kind, 1.0, _short(np.tan(np.radians(lead)) / w), _short(INTEGRAL / w), _short(corner))
    K = response.law_response(_loop(start, law), np.array([crossover]))[0]
    at = np.exp(np.interp(np.log(crossover), np.log(f), np.log(np.abs(P))))
    return law._replace(gain=_short(1.0 / (at * abs(K))))


def _short(value: float) -> float:
    return float(f"{value:.4g}")


def _named(kind: str, parts: Parts) -> str:
    return "PD" if kind == "pd" else "PI" if parts.is_speed else "PI with velocity feedback"


def _advice(parts: Parts) -> str:
    drive, sensor = parts.machine.drives[parts.drive], parts.machine.sensors[parts.feedback]
    if drive.body is not None and sensor.body != drive.body:
        return (
            f"springs lie between {drive.body} and {sensor.body}: close the loop on a sensor at {drive.body} "
            "(law.feedback), or take a law of your own"
        )
    return "lower --gm or --pm, take a faster loop.rate, or a law of your own"
