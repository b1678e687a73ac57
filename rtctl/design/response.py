"""Frequency responses of a config: its plant, its sampled law, and their loop.

    L = P H K        H = (1 - e^(-s dt)) / (s dt) e^(-s dt write)          T = P H K_ref / (1 + L)

The law is sampled and is taken from its built params, so that every filter of a law is included. The plant is its
linear model in continuous time, without dry friction and terms of physics; H is the zero-order hold of the board, and
one tick more where outputs are written at the next tick. `loop` leaves out the images beyond half the sample rate
(60 dB down on the shipped machines); `systems.sampled` includes them.

Source: thesis 8.2 (3 ms of delay), 12.7; Franklin, Powell & Workman, Digital Control of Dynamic Systems, 4.3.
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl import machines
from rtctl.config.errors import UserError
from rtctl.laws import allocation, disturbance_observer, gain_schedule, state_feedback
from rtctl.machines import described
from rtctl.machines.profile import Model
from rtctl.machines.profiles import profile_of
from rtctl.own.files import is_own, refuse_plant
from rtctl.plants.graph.linearised import linearised, sensor_row


class Loop(NamedTuple):
    """Parts of a config's loop for design: models and coefficients of plant, law, hold and delay."""

    model: Model
    blocks: dict[str, Any]  # params of the blocks of the tick, by name
    kind: str  # pd | pi_velocity | sections | state_feedback
    dt: float  # s
    delay: int  # ticks until a command is written
    factor: float  # of the gain schedule
    motor: int = 1  # that pulls, where one pulls at a time


def take(config: Any, motor: int = 1) -> Loop:
    """The parts of a config's loop. `motor` (1 or 2) says which one pulls on the reel unit, where one pulls at a time.

    Raises ValueError where the settings contradict each other.
    """
    refuse_plant(config)
    kind = getattr(config.law.position, "kind", "")
    if is_own(kind):
        raise UserError(
            f"law.position: the response of {kind} is not known from a model; measure it with rtctl identify frf"
        )
    machine = machines.build(config)
    blocks = {block.name: block.params for block in machine.diagram.blocks if block.params is not None}
    plant = next(block.params for block in machine.plant_diagram.blocks if block.name == "plant")
    return Loop(
        model=(profile_of(config.kind).model or _described)(config, plant, blocks, motor),
        blocks=blocks,
        kind=getattr(config.law.position, "kind", "pd"),
        dt=machine.dt,
        delay=int(config.loop.write == "next_tick"),
        factor=_factor(config, plant, blocks, motor) if "gain_schedule" in blocks else 1.0,
        motor=motor,
    )


def plant(config: Any, f: np.ndarray, motor: int = 1) -> np.ndarray:
    """Response (n,) of the measured position (m or rad) to the command (V) at the frequencies `f` (n,) Hz."""
    return plant_response(take(config, motor).model, f)


def law(config: Any, f: np.ndarray, motor: int = 1) -> np.ndarray:
    """Response (n,) of the command to the negative position, V per m or rad: every feedback of the law together."""
    return law_response(take(config, motor), f)


def loop(config: Any, f: np.ndarray, motor: int = 1) -> np.ndarray:
    """Loop gain (n,) at the frequencies `f` (n,) Hz, opened at the command, with hold and delay."""
    parts = take(config, motor)
    return plant_response(parts.model, f) * hold(parts, f) * law_response(parts, f)


def printed(config: Any, f: np.ndarray, motor: int = 1) -> np.ndarray:
    """Loop gain (n,) in the form of thesis 8.2: G (tau_d s + 1) without its filter, hold and tick as a pure delay.

    The gain is that of the config, schedule included. Raises UserError where the law is not a PD.
    """
    parts = take(config, motor)
    return plant_response(parts.model, f) * printed_law(parts, f)


def closed(config: Any, f: np.ndarray, motor: int = 1) -> np.ndarray:
    """Response (n,) of the measured position to the shaped reference at the frequencies `f` (n,) Hz."""
    parts = take(config, motor)
    P = plant_response(parts.model, f) * hold(parts, f)
    return P * law_response(parts, f, "reference") / (1 + P * law_response(parts, f))


def plant_response(model: Model, f: np.ndarray) -> np.ndarray:
    """Response (n,) of a model at the frequencies `f` (n,) Hz, above 0.

    By the Schur form of A and back substitution for all frequencies at once, which is exact for the double pole at 0
    of a free machine.
    """
    from scipy.linalg import schur  # slow to import, and needed here only

    s = 2j * np.pi * np.atleast_1d(np.asarray(f, float))
    T, Q = schur(model.A, output="complex")
    b, c = Q.conj().T @ model.b, model.c @ Q
    x = np.zeros((len(b), len(s)), complex)
    # einsum, not @: for so few rows BLAS wakes threads that cost far more than the sum
    for i in range(len(b) - 1, -1, -1):
        x[i] = (b[i] + np.einsum("k,kn->n", T[i, i + 1 :], x[i + 1 :])) / (s - T[i, i])
    return np.einsum("k,kn->n", c, x)


def hold(parts: Loop, f: np.ndarray) -> np.ndarray:
    """Zero-order hold and the delay until a command is written, (n,), at the frequencies `f` (n,) Hz."""
    s = 2j * np.pi * np.atleast_1d(np.asarray(f, float))
    return -np.expm1(-s * parts.dt) / (s * parts.dt) * np.exp(-s * parts.dt * parts.delay)


def law_response(parts: Loop, f: np.ndarray, path: str = "feedback") -> np.ndarray:
    """Response (n,) of the law in V per m or rad: `feedback` from the negative position, `reference` from it."""
    back = np.exp(-2j * np.pi * np.atleast_1d(np.asarray(f, float)) * parts.dt)
    p = parts.blocks["position"]
    if parts.kind == "sections":
        K = np.prod([biquad_response(section, back) for section in p], axis=0)
    elif parts.kind == "pd":
        K = p.gain + p.D * difference(p.a, p.dt, back)
    elif parts.kind == "state_feedback":
        K = state_feedback.response(p, back, path)
    else:
        K = p.gain + p.integral / (1 - back)
        if path == "feedback":
            v = parts.blocks["velocity"]
            K = K + p.velocity_gain * difference(v.a, v.dt, back)
    return compensated(parts, parts.factor * K, f, path)


def compensated(parts: Loop, K: np.ndarray, f: np.ndarray, path: str) -> np.ndarray:
    """Response (n,) of a law `K` (n,) with the filter, the integral and the disturbance observer around it."""
    blocks, back = parts.blocks, np.exp(-2j * np.pi * np.atleast_1d(np.asarray(f, float)) * parts.dt)
    if "filter" in blocks:
        K = K * np.prod([biquad_response(section, back) for section in blocks["filter"]], axis=0)
    if "integral" in blocks:
        K = K + blocks["integral"].gain / (1 - back)
    if "predictor" in blocks and path == "feedback":
        p, v = blocks["predictor"], blocks["velocity"]
        ahead = 1 + p.n * p.dt * difference(v.a, v.dt, back)
        K = K * ahead / (1 + K * sum(p.K * p.dt**2 * (n - 0.5) * back**n for n in range(1, p.n + 1)))
    if "observer" in blocks:
        to_y, to_u = disturbance_observer.response(blocks["observer"], f, parts.motor == 2)
        K = (K + to_y if path == "feedback" else K) / (1 - to_u)
    return np.asarray(K)


def printed_law(parts: Loop, f: np.ndarray) -> np.ndarray:
    """G (tau_d s + 1) with hold and tick as a pure delay, (n,) V per m or rad. Raises UserError where it is no PD."""
    if parts.kind != "pd":
        raise UserError(f"law.position: the response of 5.4 is that of a pd, not of {parts.kind}")
    s, p = 2j * np.pi * np.atleast_1d(np.asarray(f, float)), parts.blocks["position"]
    return parts.factor * (p.gain + p.D * s) * np.exp(-s * parts.dt * (0.5 + parts.delay))


def difference(a: float, dt: float, back: np.ndarray) -> np.ndarray:
    """Response of the filtered backward difference a (1 - b) / dt / (1 - (1 - a) b), `back` = e^(-j w dt)."""
    return a * (1 - back) / dt / (1 - (1 - a) * back)


def biquad_response(p: Any, back: np.ndarray) -> np.ndarray:
    """Response of a second-order section with the params `p`, `back` = e^(-j w dt)."""
    return (p.b0 + (p.b1 + p.b2 * back) * back) / (1 + (p.a1 + p.a2 * back) * back)


def _described(config: Any, p: Any, blocks: dict[str, Any], motor: int) -> Model:
    A, B = linearised(p)
    machine = config.machine
    name = described.parts_of(config).feedback
    return Model(A, B @ blocks["machine"].shares[: B.shape[1]], sensor_row(machine, p, name))


def _factor(config: Any, p: Any, blocks: dict[str, Any], motor: int) -> float:
    """Factor of the gain schedule for the radii that the laws use."""
    if config.law.gain_schedule.mode == "off":
        return 1.0
    R1, R2 = (p.R1, p.R2) if config.radius.source == "measured" else (config.radius.R1, config.radius.R2)
    kind = blocks["allocation"].kind
    direction = 0.0 if kind == allocation.DIFFERENTIAL else 1.0 if motor == 1 or kind == allocation.MOTOR1 else -1.0
    s = np.zeros(1, gain_schedule.GAIN_SCHEDULE_STATE)[0]
    return float(gain_schedule.step(blocks["gain_schedule"], s, R1, R2, direction))
