"""Motion of a machine along its reference: displacement of each coordinate per unit of it, and the forces required.

    min phi' K phi,  c phi = 1            shape of the motion: rigid body if the machine is free, else least stiffness
    K d = F,  l d = 0                     deflection under the forces of the motion, the followed body held

Source: Craig & Bampton, Coupling of substructures, AIAA J. 6 (1968), constraint modes.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rtctl.laws.model_feedforward import ModelFeedforwardParams
from rtctl.plants.graph.params import GraphParams
from rtctl.plants.linear import MOST_BODIES, MOST_DRIVES


class Mechanics(NamedTuple):
    """Linear model of a machine and its parts, for a feedforward."""

    graph: GraphParams
    A: np.ndarray  # (nx, nx) without weight
    plus: np.ndarray  # (nx,) input of a positive command
    minus: np.ndarray  # (nx,) input of a negative command
    c: np.ndarray  # (nx,) feedback by state
    inputs: np.ndarray  # (nu,) of each drive for one unit of command
    rows: dict[str, np.ndarray]  # (nq,) position of each body by coordinate
    place_of: Callable[[Any], Any]  # entry of a physics list -> Spot
    k_v: float  # velocity feedback of the law, command per unit and s
    shaped: bool


class Motion(NamedTuple):
    """Matrices over the coordinates, (nq,) or (nq, nq)."""

    phi: np.ndarray
    M: np.ndarray
    D: np.ndarray
    K: np.ndarray
    plus: np.ndarray
    minus: np.ndarray


def motion(mechanics: Mechanics) -> Motion:
    """Shape of the motion and static matrices, with the drives in steady state.

    Raises ValueError where the command does not move the feedback.
    """
    g, A = mechanics.graph, mechanics.A
    nq = g.nq
    M = np.asarray(g.inertia[:nq], float)
    pushes = [mechanics.plus, mechanics.minus]
    inner = A[nq : 2 * nq]
    others = slice(2 * nq, len(A))
    through = np.zeros((nq, 2 * nq))
    forces = [b[nq : 2 * nq] for b in pushes]
    if len(A) > 2 * nq:
        rest = np.linalg.solve(A[others, others], np.column_stack([A[others, : 2 * nq], *(b[others] for b in pushes)]))
        through = inner[:, others] @ rest[:, : 2 * nq]
        forces = [b - inner[:, others] @ rest[:, 2 * nq + i] for i, b in enumerate(forces)]
    K = -M[:, None] * (inner[:, :nq] - through[:, :nq])
    D = -M[:, None] * (inner[:, nq : 2 * nq] - through[:, nq:])
    c = mechanics.c[:nq] if np.any(mechanics.c[:nq]) else mechanics.c[nq : 2 * nq]
    phi = _constrained(K, M, c)[:nq, nq]
    plus, minus = (M * b for b in forces)
    if abs(phi @ plus) < 1e-12 * np.linalg.norm(phi) * np.linalg.norm(plus):
        raise ValueError(
            "the command does not move the feedback along its reference; a feedforward has nothing to act by"
        )
    return Motion(phi, M, D, K, plus, minus)


def params(mechanics: Mechanics, settings: Any, dt: float) -> ModelFeedforwardParams:
    """Params of the feedforward for a tick of `dt` s. Raises ValueError where a setting does not fit the machine."""
    made, g = motion(mechanics), mechanics.graph
    nq = g.nq
    shift, row = np.zeros(nq), mechanics.c[:nq]
    if settings.through is not None:
        if settings.through not in mechanics.rows:
            known = ", ".join(mechanics.rows) or "none"
            raise ValueError(f"feedforward.through: there is no body '{settings.through}'; there is {known}")
        row = mechanics.rows[settings.through]
    bend = _constrained(made.K, made.M, row)[:nq, :nq]
    if settings.through is not None:
        shift = mechanics.c[:nq] @ bend
    free = g._replace(winds=0)
    return ModelFeedforwardParams(
        graph=free,
        phi=_wide(made.phi),
        mass=_wide(settings.inertia * made.M * made.phi),
        viscous=_wide(settings.viscous * made.D @ made.phi),
        stiff=_wide(settings.viscous * made.K @ made.phi),
        dry=_wide(settings.friction * g.dry[:nq]),
        push=_wide(made.plus),
        plus=float(made.phi @ made.plus),
        minus=float(made.phi @ made.minus),
        lead=settings.lead,
        behind=settings.behind,
        k_v=settings.velocity * mechanics.k_v,
        shaped=int(mechanics.shaped),
        inputs=np.pad(mechanics.inputs, (0, MOST_DRIVES - len(mechanics.inputs))),
        shift=_wide(shift),
        bend=_square(bend),
        dt=dt,
    )


def _constrained(K: np.ndarray, M: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Inverse of [[K, row'], [row, 0]], (nq + 1, nq + 1), by least squares in coordinates of equal inertia."""
    nq = len(M)
    root = 1.0 / np.sqrt(M)
    small = K * root[:, None] * root[None, :]
    scale = max(np.abs(small).max(), 1e-300)
    edge = row * root
    norm = np.linalg.norm(edge)
    whole = np.zeros((nq + 1, nq + 1))
    whole[:nq, :nq] = 0.5 * (small + small.T) / scale
    whole[:nq, nq] = whole[nq, :nq] = edge / norm
    inverse = np.linalg.pinv(whole, rcond=1e-11)
    out = np.zeros_like(whole)
    out[:nq, :nq] = inverse[:nq, :nq] * root[:, None] * root[None, :] / scale
    out[:nq, nq] = inverse[:nq, nq] * root / norm
    return out


def _wide(values: np.ndarray) -> np.ndarray:
    out = np.zeros(MOST_BODIES)
    out[: len(values)] = values
    return out


def _square(values: np.ndarray) -> np.ndarray:
    out = np.zeros((MOST_BODIES, MOST_BODIES))
    out[: len(values), : len(values)] = values
    return out
