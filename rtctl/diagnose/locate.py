"""Where simulation and recording part: channel, node, axis, since when, and how much of the error lives there."""

import numpy as np

from rtctl.diagnose.diagnosis import Located
from rtctl.diagnose.fit import Fit, Problem
from rtctl.diagnose.name import Search
from rtctl.diagnose.simulate import Simulator, per_unit
from rtctl.plants.physics import TERMS


def located(sim: Simulator, problem: Problem, base: Fit, best: Fit, looked: Search, ticks: bool = False) -> Located:
    """Of the fitted base's error; `ticks`: they come off their times, and no hypothesis may be needed beside that."""
    n = len(base.r) // len(problem.channels)
    error = base.r.reshape(len(problem.channels), n)
    worst = int(np.argmax(np.mean(error**2, axis=1)))
    channel = sim.channels[problem.channels[worst]]
    step = sim.record.dt * problem.mean
    first = sim.record.dt * (problem.rows.start or 0)
    loud = np.flatnonzero(np.abs(error[worst]) > 4 * problem.floor)
    since = float(first + step * loud[0]) if len(loud) else 0.0
    if ticks and not best.space.hypotheses:
        return Located(channel, "loop", "time", "at every tick, the more the faster it moves", first, 1.0)
    top = best if best.space.hypotheses else looked.fits[0] if looked.fits else None
    if top is None or not top.space.hypotheses:
        return Located(channel, "loop", "time", "everywhere", since, 0.0)
    h = top.space.hypotheses[0]
    axis = TERMS[h.term].axis
    share = float(np.clip(1.0 - top.cost / base.cost, 0.0, 1.0))
    return Located(channel, h.node, axis, where(sim, problem, error[worst], axis), since, share)


def where(sim: Simulator, problem: Problem, error: np.ndarray, axis: str) -> str:
    """In words: the part of the axis that holds most of the error."""
    x = sim.record.y[sim.channels[0]] / per_unit(sim.record.case)[0]
    v = np.gradient(x, sim.record.dt)
    u = sim.record.u[:, 0]
    values = {"velocity": v, "position": x, "angle": x, "command": u, "time": sim.record.t}.get(axis, sim.record.t)
    rows = values[problem.rows][: len(error) * problem.mean].reshape(-1, problem.mean).mean(axis=1)
    edges = np.quantile(rows, np.linspace(0, 1, 9))
    index = np.clip(np.searchsorted(edges, rows, side="right") - 1, 0, 7)
    power = np.array([np.mean(error[index == k] ** 2) if (index == k).any() else 0.0 for k in range(8)])
    if power.max() < 2.5 * np.median(power):
        return f"over all of the {axis}"
    k = int(np.argmax(power))
    return f"{axis} {edges[k]:.3g} to {edges[k + 1]:.3g}"
