"""Linear model of a described machine around its start: springs, dampers, drives and the pull of weight, and its modes.

    x' = A x + B u,   modes: eigenvalues s of A, frequency |s| / 2 pi, damping -Re s / |s|

Dry friction is left out: it has no linear model.

Source: Meirovitch, Fundamentals of Vibrations (2001), ch. 7.
"""

import math
from typing import NamedTuple

import numpy as np

from rtctl.plants.graph.description import Description
from rtctl.plants.graph.params import GraphParams
from rtctl.plants.graph.plant import state_space

STILL = 1e-4  # 1/s, below which an eigenvalue is a free motion


class Mode(NamedTuple):
    """One motion of the machine by itself."""

    hertz: float  # 0 for a motion that does not swing
    damping: float  # share of critical; negative where the motion grows
    rate: float  # 1/s, of a motion that does not swing; positive where it grows
    bodies: tuple[str, ...]  # that move most, against each other where there are two


def linearised(p: GraphParams) -> tuple[np.ndarray, np.ndarray]:
    """A (nx, nx) and B (nx, nu) around the start, with the weight of bodies that turn as a spring."""
    A, B = state_space(p)
    for k in range(p.weights):
        if p.weight_turns[k]:
            i, a = int(p.weight_i[k]), float(p.weight_a[k])
            A[p.nq + i, i] -= a * a * float(p.weight_force[k]) * math.cos(float(p.weight_angle[k])) / float(p.inertia[i])
    return A, B


def sensor_row(machine: Description, p: GraphParams, name: str) -> np.ndarray:
    """What a sensor of position or speed shows of the state, (nx,), SI."""
    n, row = list(machine.sensors).index(name), np.zeros(p.nx)
    at = 0 if machine.sensors[name].measures == "position" else p.nq
    row[at + int(p.sensor_i[n])] += p.sensor_a[n]
    row[at + int(p.sensor_j[n])] += p.sensor_b[n]
    return row


def modes(machine: Description, p: GraphParams, names: list[str], coordinates: list[int]) -> list[Mode]:
    """Modes by rising frequency. `names` are the bodies that move, `coordinates` the coordinate of each."""
    A, _ = linearised(p)
    values, vectors = np.linalg.eig(_scaled(A, p))
    found = []
    for s, v in zip(values, vectors.T, strict=True):
        if s.imag < 0:
            continue
        shape = np.abs(v[: p.nq]) + np.abs(v[p.nq : 2 * p.nq])
        most = [name for name, at in zip(names, coordinates, strict=True) if shape[at] > 0.3 * shape.max()]
        if s.imag > STILL:
            found.append(Mode(abs(s) / (2 * np.pi), -s.real / abs(s), 0.0, tuple(most)))
        elif abs(s.real) > STILL:
            found.append(Mode(0.0, 1.0, float(s.real), tuple(most)))
    return sorted(found, key=lambda mode: (mode.hertz, -mode.rate))


def _scaled(A: np.ndarray, p: GraphParams) -> np.ndarray:
    """A in coordinates of equal inertia, so that an eigenvector says how the energy is shared."""
    root = np.sqrt(p.inertia[: p.nq])
    scale = np.concatenate([root, root, np.ones(p.nx - 2 * p.nq)])
    return A * scale[:, None] / scale[None, :]
