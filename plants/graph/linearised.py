"""Linear model of a described machine around its start: springs, dampers, drives and the pull of weight, and its modes.

    x' = A x + B u,   modes: eigenvalues s of A, frequency |s| / 2 pi, damping -Re s / |s|

Dry friction is left out: it has no linear model.

Source: Meirovitch, Fundamentals of Vibrations (2001), ch. 7; Perez-Arriaga, Verghese & Schweppe, Selective modal
analysis, IEEE Trans. PAS 101 (1982) for the participation of states.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rtctl.plants.graph import coupled
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.params import GraphParams
from rtctl.plants.graph.plant import state_space

STILL = 1e-4  # 1/s, below which an eigenvalue is a free motion
RINGS = 1e-3  # least share of the imaginary part in an eigenvalue that rings


class Mode(NamedTuple):
    """One mode of the machine."""

    hertz: float  # 0 for a mode that does not oscillate
    damping: float  # share of critical; negative for an unstable mode
    rate: float  # 1/s, of a mode that does not oscillate; positive for an unstable mode
    bodies: tuple[str, ...]  # with the largest participation; empty for a mode of a drive


def linearised(p: Any) -> tuple[np.ndarray, np.ndarray]:
    """A (nx, nx) and B (nx, nu) around the start, with the weight of bodies that turn as a spring."""
    code = getattr(type(p), "code", None)
    A, B = state_space(p) if code is None else coupled.linearised(code, p)
    for k in range(p.weights):
        if p.weight_turns[k]:
            i, a = int(p.weight_i[k]), float(p.weight_a[k])
            q = float(p.coupled.q0[i]) if code is not None else 0.0
            pull = a * a * float(p.weight_force[k]) * math.cos(a * q + float(p.weight_angle[k]))
            if code is None:
                A[p.nq + i, i] -= pull / float(p.inertia[i])
            else:
                inverse = np.linalg.inv(coupled.at_start(code, p, p.coupled)[0])
                A[p.nq : 2 * p.nq, i] -= pull * inverse[:, i]
    return A, B


def ringing(p: GraphParams) -> np.ndarray:
    """Eigenvalues, 1/s, of the springs and dampers of a machine without mechanics of a file that ring, without weight;
    both of each pair."""
    poles = np.linalg.eigvals(state_space(p)[0])
    return np.asarray(poles[np.abs(poles.imag) > RINGS * np.abs(poles)])


def sensor_row(machine: Description, p: GraphParams, name: str) -> np.ndarray:
    """Output row (nx,) of a sensor of position or speed, SI."""
    n, row = list(machine.sensors).index(name), np.zeros(p.nx)
    at = 0 if machine.sensors[name].measures == "position" else p.nq
    row[at + int(p.sensor_i[n])] += p.sensor_a[n]
    row[at + int(p.sensor_j[n])] += p.sensor_b[n]
    return row


def modes(machine: Description, p: GraphParams, names: list[str], coordinates: list[int]) -> list[Mode]:
    """Modes by rising frequency. `names` are the bodies that move, `coordinates` the coordinate of each."""
    from scipy.linalg import eig  # slow to import, and needed here only

    A, _ = linearised(p)
    values, left, right = eig(A, left=True)
    found = []
    for s, w, v in zip(values, left.T, right.T, strict=True):
        if s.imag < 0 or abs(s) < STILL:
            continue
        share = np.abs(w.conj() * v)  # participation of each state, whatever its unit
        each = share[: p.nq] + share[p.nq : 2 * p.nq]
        most = [name for name, at in zip(names, coordinates, strict=True) if each[at] > 0.2 * each.max()]
        bodies = tuple(most) if each.sum() > share[2 * p.nq :].sum() else ()
        if s.imag > STILL:
            found.append(Mode(float(abs(s) / (2 * np.pi)), float(-s.real / abs(s)), 0.0, bodies))
        else:
            found.append(Mode(0.0, 1.0, float(s.real), bodies))
    return sorted(found, key=lambda mode: (mode.hertz, -mode.rate))
