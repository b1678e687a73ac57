"""Where simulation and recording part: channel, node, axis, since when, and how much of the error lives there.

With a name, node and axis are the term's own. Without one, the axis is the one along which the missing force, as a
disturbance observer sees it, repeats itself best, and the node is where a push keeps the model right (`stands`).
"""

import numpy as np

from rtctl.diagnose.diagnosis import Located
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.hints import ORDERS, observe, spectrum
from rtctl.diagnose.model import Model
from rtctl.diagnose.name import Search
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.quantities import of_main
from rtctl.diagnose.simulate import Simulator, way
from rtctl.diagnose.stands import MOSTLY, stands
from rtctl.plants.physics import TERMS

BINS = 24  # along an axis
REPEATS = 0.35  # share of the missing force that must repeat along an axis, to be told
UNITS = {"velocity": "speed", "position": "position", "angle": "position", "command": "command"}  # of Quantities


def located(
    sim: Simulator, problem: Problem, base: Fit, best: Fit, looked: Search, named: bool = True, ticks: bool = False
) -> Located:
    """Of the fitted base's error.

    `named`: the terms of `best` are there, else they are a guess; `ticks`: ticks come off their times, and no
    hypothesis may be needed beside that.
    """
    errors = problem.by_sensor(base.r)
    channel = max(errors, key=lambda name: float(np.mean(errors[name] ** 2)))
    error = problem.at_rows(channel, errors[channel])
    first = problem.rows.start or 0
    loud = np.flatnonzero(np.abs(error) > 4 * problem.floor)
    since = float(sim.record.t[first + problem.mean * loud[0]]) if len(loud) else 0.0  # by the recording's own clock
    if ticks and not best.space.hypotheses:
        begun = float(sim.record.t[first])
        return Located(channel, "loop", "time", "at every tick, the more the faster it moves", begun, 1.0)
    share, axis, node = 0.0, "time", ""
    top = next((f for f in (best, *looked.fits) if f.space.hypotheses), None)
    if top is not None:
        h = top.space.hypotheses[0]
        share = float(np.clip(1.0 - top.cost / base.cost, 0.0, 1.0))
        axis, node = TERMS[h.term].axis, h.node
    named = named and bool(best.space.hypotheses)
    if not named:
        node = stands(problem, base.model, node, share)
    if not named or share < MOSTLY:
        axis = repeats(sim, base.model) or axis
    return Located(channel, node, axis, where(sim, problem, error, axis), since, share)


def along(sim: Simulator) -> dict[str, np.ndarray]:
    """Values (n,) of each axis that every record has."""
    x = way(sim.record)
    return {
        "velocity": np.gradient(x, sim.record.dt),
        "position": x,
        "command": sim.record.u[:, 0],
        "time": sim.record.t - sim.record.t[0],
    }


def repeats(sim: Simulator, model: Model) -> str:
    """The axis along which most of the force that `model` lacks repeats itself; empty where none does."""
    _, push = observe(sim, model)
    start = len(push) // 20
    total = float(np.var(push[start:])) or 1.0
    shares = {}
    for name, values in along(sim).items():
        v, d = values[start:], push[start:]
        index = np.searchsorted(np.quantile(v, np.linspace(0, 1, BINS + 1)[1:-1]), v)
        count = np.maximum(np.bincount(index, minlength=BINS), 1)
        mean = np.bincount(index, d, BINS) / count
        shares[name] = float(count @ (mean - d.mean()) ** 2) / len(d) / total
    x = along(sim)["position"][start:]
    thin = max(1, len(x) // 8000)
    if of_main(sim.case).rotary:
        shares["angle"] = float(spectrum(x[::thin], push[start::thin], ORDERS).max(initial=0.0))
    best = max(shares, key=lambda name: shares[name])
    return best if shares[best] > REPEATS else ""


def where(sim: Simulator, problem: Problem, error: np.ndarray, axis: str) -> str:
    """In words: the part of the axis that holds most of the error; of time where the axis has no values of its own."""
    values = along(sim)
    values["angle"] = values["position"]
    name = axis if axis in values else "time"
    rows = values[name][problem.rows][: len(error) * problem.mean].reshape(-1, problem.mean).mean(axis=1)
    edges = np.quantile(rows, np.linspace(0, 1, 9))
    index = np.clip(np.searchsorted(edges, rows, side="right") - 1, 0, 7)
    power = np.array([np.mean(error[index == k] ** 2) if (index == k).any() else 0.0 for k in range(8)])
    if power.max() < 2.5 * np.median(power):
        return f"over all of the {axis}"
    k = int(np.argmax(power))
    unit = getattr(of_main(sim.case), UNITS[name]) if name in UNITS else "s"
    return f"{name} {edges[k]:.3g} to {edges[k + 1]:.3g} {unit}"
