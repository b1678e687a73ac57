"""What the laws of a fitted model may be wrong by, as its residuals show it (slack.py)."""

from collections.abc import Callable

import numpy as np

from rtctl.diagnose.likelihood.descent import weights
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.slack import Inexact, columns
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.node_scaling import Measures, speed
from rtctl.diagnose.model.space import Space

Part = Callable[[np.ndarray], np.ndarray]  # of what an effect does (blocks, sensors)


def errors(like: Likelihood, space: Space, x: np.ndarray, e: np.ndarray, J: np.ndarray) -> Inexact:
    """Errors of the laws of a model with the residuals e (blocks, sensors) and their derivatives J (blocks, sensors,
    unknowns): those of the description, of the effects beside it, and of a number that is wrong by far."""
    none = np.zeros((*e.shape, 0))
    given = Inexact(none, none) if like.own is None else like.own
    own = beyond(like, space, J)
    effects = [effect(like, space.model_without(i, x), e, h.node, own) for i, h in enumerate(space.hypotheses)]
    if space.doubted:
        effects.append(effect(like, space.model_believed(x), e, space.doubted.split(".")[1]))
    return given._replace(laws=np.concatenate([given.laws, *effects], axis=2))


def beyond(like: Likelihood, space: Space, J: np.ndarray) -> Part:
    """What an effect does that other numbers of the description do not do in its place, as far as the owner lets them.

    A second spring beside a joint whose stiffness nobody knows may be as strong as it likes. If its law were wrong by
    a share of all that it does, it would be a licence for any error beside it.
    """
    count = space.nb
    white = like.plain(J[..., :count])
    inner = like.power * white.T @ white + np.diag(weights(space)[:count])

    def part(done: np.ndarray) -> np.ndarray:
        instead = np.linalg.solve(inner, like.power * white.T @ like.plain(done))
        return np.asarray(done - J[..., :count] @ instead)

    return part


def effect(like: Likelihood, without: GraphModel, e: np.ndarray, node: str, part: Part = np.asarray) -> np.ndarray:
    """Errors (blocks, sensors, columns) of what a node has in the model with the residuals e, and not in `without`, or
    of a part of that; none where that runs away."""
    lacking = like.raw(without)
    if like.ran_away(lacking) or not np.any(lacking - e):
        return np.zeros((*e.shape, 0))
    return columns(part(lacking - e), pace(like, without, node))


def pace(like: Likelihood, model: GraphModel, node: str) -> np.ndarray:
    """Speed (blocks,) of what a node belongs to, rad/s or m/s."""
    out = []
    for part in like.parts:
        measures = Measures(part.sim, model.base, {})
        begin, end = part.rows
        v = speed(measures.way(measures.body_of(node)), part.sim.record.dt)[begin:end]
        out.append(v[: len(v) // part.mean * part.mean].reshape(-1, part.mean).mean(axis=1))
    return np.concatenate(out)
