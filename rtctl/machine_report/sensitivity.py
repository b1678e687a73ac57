"""Sensitivity of a machine's sensors to its parameters: identifiable parameters and unidentifiable combinations.

    J[:, j] = (y(theta_j (1 + d)) - y(theta_j (1 - d))) / (2 d sigma)       J / |J_j| = U S V^T

Every drive gets its own multisine, every parameter is changed by a small share of itself, and each sensor's output is
divided by the sensor's step. A singular value near zero is a combination of parameters without effect on any sensor.
Without a force sensor, all inertias, frictions and the drive's gain together are such a combination.

Source: Walter & Pronzato, Identification of Parametric Models from Experimental Data (1997), ch. 6.
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.machines.described_plant import FINE
from rtctl.machines.described_settings import FULL
from rtctl.plants.graph.coupled import machine_params
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.layout import layout as layout_of
from rtctl.plants.graph.played import played

SECONDS, MOST_ROWS = 5.0, 5000
WINDOW = 0.05  # s, interval of a position's change; initial position and slow drift carry little information
SHARE = 0.35  # rms of a drive's multisine, relative to the drive's limit
CHANGE = 0.01  # relative change of a parameter, for the finite difference
TOLERANCE = 0.15  # usual relative error of a nominal value
SURE = 5.0  # least effect of a change by TOLERANCE, in steps of all sensors together
SAME = 8e-3  # singular value of the normalised sensitivities below which a combination is not identifiable
TWINS = 1e-5  # 1 - |correlation| below which two parameters have one effect: factors of a product
PART = 0.2  # least share of a parameter in a combination, relative to the largest
LEFT_OUT = ("limit", "output_limit", "dac_range", "counts_per_unit", "per_unit", "resolution", "noise")


class Group(NamedTuple):
    """Parameters that are identifiable only together, and their changes that no sensor shows."""

    names: tuple[str, ...]
    changes: tuple[float, ...]  # relative, the largest is 1


class Sensitivity(NamedTuple):
    """Identifiability of a machine's parameters by its sensors."""

    names: tuple[str, ...]
    rank: int
    told: dict[str, float]  # parameter -> relative standard deviation
    groups: tuple[Group, ...]
    unseen: tuple[str, ...]


def parameters(machine: Description) -> list[str]:
    """Dotted paths of the parameters to judge: numbers that affect the motion and are not 0."""
    return [
        path
        for path, value in machine.paths()
        if value != 0.0
        and path.rpartition(".")[2] not in LEFT_OUT
        and not path.startswith("sensors.")
        and not (path.startswith("drives.") and path.endswith(".damping") and not _has_filter(machine, path))
    ]


def _has_filter(machine: Description, path: str) -> bool:
    return machine.drives[path.split(".")[1]].bandwidth_hz is not None


def commands(config: Any, n: int, dt: float) -> np.ndarray:
    """Multisine for each drive, (n, drives), in the drive's unit."""
    rng = np.random.default_rng(1)
    t = np.arange(n) * dt
    f = np.geomspace(2.0 / (n * dt), 0.2 / dt, 40)
    u = []
    for drive in config.machine.drives.values():
        wave = np.sum(np.sin(2 * np.pi * np.outer(t, f) + rng.uniform(0, 2 * np.pi, len(f))), axis=1)
        u.append(SHARE * (drive.limit or FULL) * wave / np.sqrt(np.mean(wave**2)))
    return np.stack(u, axis=1)


def sensitivity(config: Any) -> Sensitivity:
    """Identifiability of a described machine's parameters, from a simulated multisine of SECONDS at most."""
    machine: Description = config.machine
    dt = 1.0 / config.loop.rate
    n = min(round(SECONDS / dt), MOST_ROWS)
    substeps = max(1, int(np.ceil(dt / config.plant.substep - 1e-9)))
    u, names = commands(config, n, dt), parameters(machine)
    layout, values = layout_of(machine), dict(machine.paths())
    steps = np.array([s.noise or s.grain or FINE for s in machine.sensors.values()])
    scales = np.array([s.scale for s in machine.sensors.values()]) / steps

    moves = np.array([s.measures == "position" for s in machine.sensors.values()])
    lag = max(1, round(WINDOW / dt))

    def shown(path: str, factor: float) -> np.ndarray:
        p = machine_params(layout, {**values, path: values[path] * factor}, dt / substeps)
        y = played(p, u, substeps) * scales
        return np.where(moves, y[lag:] - y[:-lag], y[lag:]).ravel()

    J = np.stack([(shown(p, 1 + CHANGE) - shown(p, 1 - CHANGE)) / (2 * CHANGE) for p in names], axis=1)
    return judged(names, np.nan_to_num(J, nan=0.0, posinf=0.0, neginf=0.0))


def judged(names: list[str], J: np.ndarray) -> Sensitivity:
    """Identifiability from the whitened sensitivities J, (rows, parameters)."""
    norms: np.ndarray = np.sqrt((J * J).sum(axis=0))
    unseen = tuple(name for name, norm in zip(names, norms, strict=True) if norm * TOLERANCE < SURE)
    seen: list[int] = [i for i, norm in enumerate(norms) if norm * TOLERANCE >= SURE]
    if not seen:
        return Sensitivity(tuple(names), 0, {}, (), unseen)
    R = J[:, seen] / norms[seen]
    twins = _twins(R)
    heads = [members[0] for members in twins]
    sizes = norms[seen][heads]
    _, S, Vt = np.linalg.svd(R[:, heads], full_matrices=False)
    directions = Vt / sizes  # relative change of each parameter
    strong = S >= np.maximum(SAME, SURE / TOLERANCE * np.abs(directions).max(axis=1))
    groups = [Group(tuple(names[seen[i]] for i in members), ()) for members in twins if len(members) > 1]
    bound = {name for group in groups for name in group.names}
    for d in _sparse(directions[~strong]):
        part = [i for i in range(len(heads)) if abs(d[i]) > PART]
        groups.append(Group(tuple(names[seen[heads[i]]] for i in part), tuple(float(d[i]) for i in part)))
    spread = np.sqrt(((directions[strong] / S[strong, None]) ** 2).sum(axis=0))
    unseen += tuple(g.names[0] for g in groups if len(g.names) == 1 and g.names[0] not in bound)
    groups = [group for group in groups if len(group.names) > 1]
    bound |= {name for group in groups for name in group.names} | set(unseen)
    told = {names[seen[i]]: float(spread[j]) for j, i in enumerate(heads) if names[seen[i]] not in bound}
    return Sensitivity(tuple(names), int(strong.sum()), told, tuple(groups), unseen)


def _twins(R: np.ndarray) -> list[list[int]]:
    """Indices of the unit columns of R, grouped by direction: factors of a product, parts of a sum."""
    found: list[list[int]] = []
    alike = np.abs(R.T @ R) > 1.0 - TWINS
    for i in range(R.shape[1]):
        group = next((members for members in found if alike[i, members[0]]), None)
        if group is None:
            found.append([i])
        else:
            group.append(i)
    return found


def _sparse(directions: np.ndarray) -> np.ndarray:
    """Basis of the space of `directions` with zeros by elimination; the largest entry of each vector is 1."""
    N = directions / np.abs(directions).max(axis=1, keepdims=True) if len(directions) else directions
    N = N.copy()
    for k in range(len(N)):
        row, column = divmod(int(np.argmax(np.abs(N[k:]))), N.shape[1])
        N[[k, k + row]] = N[[k + row, k]]
        N[k] /= N[k, column]
        for other in range(len(N)):
            if other != k:
                N[other] -= N[other, column] * N[k]
    return np.stack([d / d[np.argmax(np.abs(d))] for d in N]) if len(N) else N


def sentences(found: Sensitivity) -> list[str]:
    """Lines of text for a result."""
    lines = [f"{found.rank} of {len(found.names)} parameters, from a multisine of {SECONDS:g} s"]
    if found.told:
        by = sorted(found.told.items(), key=lambda item: item[1])
        lines.append("each by itself: " + ", ".join(short(name) for name, _ in by))
    for group in found.groups:
        alike = group.changes and all(abs(c - 1.0) < 0.3 for c in group.changes)
        why = "; all may be larger by one factor, and no sensor shows it" if alike else ""
        lines.append(f"only together: {', '.join(map(short, group.names))}{why}")
    if found.unseen:
        lines.append(f"not at all, or too little: {', '.join(map(short, found.unseen))}")
    return lines


def short(path: str) -> str:
    """A dotted path without its group: motor.inertia."""
    return path.split(".", 1)[1]
