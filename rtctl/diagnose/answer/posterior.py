"""Posterior of a diagnosis as a list: combinations of effects, the description alone, and what has no name."""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.answer.answer import GraphDiagnosis
from rtctl.diagnose.answer.words import called, here


class Bar(NamedTuple):
    """One rival."""

    names: tuple[str, ...]  # term:node
    free: str  # in words, of what has no name
    probability: float
    behind: float  # ln of its posterior over that of the likeliest, on the whole recording


def rivals(d: GraphDiagnosis) -> list[Bar]:
    """All rivals, likeliest first; their probabilities sum to one. Numbers of hats along one axis are one rival."""
    machine = d.record.case.machine
    found: dict[tuple[tuple[str, ...], str], list[float]] = {}
    for rival in d.decided.table:
        words = ""
        if rival.unlisted and rival.free is not None:
            words = f"{rival.free.kind} without a name at {here(machine, rival.free.node)}, by {rival.free.axis}"
            if rival.fit.names:
                words += ", beside " + " + ".join(called(machine, n) for n in rival.fit.names)
        bar = found.setdefault((rival.fit.names, words), [0.0, -np.inf])
        bar[0] += rival.probability
        bar[1] = max(bar[1], rival.merit)
    top = max(merit for _, merit in found.values())
    bars = [Bar(names, words, p, merit - top) for (names, words), (p, merit) in found.items()]
    return sorted(bars, key=lambda bar: (-bar.probability, -bar.behind))
