"""What the laws of a fitted model may be wrong by, as its residuals show it (slack.py)."""

import numpy as np

from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.slack import columns
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.node_scaling import Measures, speed
from rtctl.diagnose.model.space import Space


def errors(like: Likelihood, space: Space, x: np.ndarray, e: np.ndarray) -> np.ndarray | None:
    """Errors (blocks, sensors, columns) of the effects of a model with the residuals e; None where there is none."""
    out = []
    for index, h in enumerate(space.hypotheses):
        without = like.raw(space.model_without(index, x))
        if not like.ran_away(without):
            out.append(columns(without - e, pace(like, space.model(x), h.node)))
    return np.concatenate(out, axis=2) if out else None


def pace(like: Likelihood, model: GraphModel, node: str) -> np.ndarray:
    """Speed (blocks,) of what a node belongs to, rad/s or m/s."""
    out = []
    for part in like.parts:
        measures = Measures(part.sim, model.base, {})
        begin, end = part.rows
        v = speed(measures.way(measures.body_of(node)), part.sim.record.dt)[begin:end]
        out.append(v[: len(v) // part.mean * part.mean].reshape(-1, part.mean).mean(axis=1))
    return np.concatenate(out)
