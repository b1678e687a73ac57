"""Errors of the laws of a fitted model, as columns of its residual (slack.py)."""

import numpy as np

from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.slack import Inexact, columns
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.node_scaling import Measures, speed
from rtctl.diagnose.model.space import Space


def errors(like: Likelihood, space: Space, x: np.ndarray, e: np.ndarray) -> Inexact:
    """Errors of the laws of a model with the residuals e (blocks, sensors).

    The laws are those of the description, of the effects beside it, and of a number with a gross error.
    """
    none = np.zeros((*e.shape, 0))
    given = Inexact(none, none) if like.own is None else like.own
    effects = [effect(like, space.model_without(i, x), e, h.node) for i, h in enumerate(space.hypotheses)]
    if space.doubted:
        effects.append(effect(like, space.model_believed(x), e, space.doubted.split(".")[1]))
    return given._replace(laws=np.concatenate([given.laws, *effects], axis=2))


def effect(like: Likelihood, without: GraphModel, e: np.ndarray, node: str) -> np.ndarray:
    """Errors (blocks, sensors, columns) of an effect at a node; no columns where the model `without` it diverges.

    The residuals e (blocks, sensors) are those of the model with the effect.
    """
    lacking = like.raw(without)
    if like.ran_away(lacking) or not np.any(lacking - e):
        return np.zeros((*e.shape, 0))
    return columns(lacking - e, pace(like, without, node))


def pace(like: Likelihood, model: GraphModel, node: str) -> np.ndarray:
    """Speed (blocks,) of the body of a node, rad/s or m/s."""
    out = []
    for part in like.parts:
        measures = Measures(part.sim, model.base, {})
        begin, end = part.rows
        v = speed(measures.way(measures.body_of(node)), part.sim.record.dt)[begin:end]
        out.append(v[: len(v) // part.mean * part.mean].reshape(-1, part.mean).mean(axis=1))
    return np.concatenate(out)
