"""Posterior of a diagnosis as a list: combinations of effects, the description alone, and a force without a name."""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.graph.answer import GraphDiagnosis
from rtctl.diagnose.graph.verdict import UNLISTED, evidence
from rtctl.diagnose.graph.words import called, here


class Bar(NamedTuple):
    """One rival."""

    names: tuple[str, ...]  # term:node
    free: str  # in words, of a force without a name
    probability: float
    behind: float  # ln of its probability over that of the likeliest


def rivals(d: GraphDiagnosis) -> list[Bar]:
    """All rivals, likeliest first; their probabilities sum to one."""
    found, free, machine = d.found, d.decided.unlisted, d.record.case.machine
    entries: list[tuple[tuple[str, ...], str, float]] = [(f.names, "", found.merit(f)) for f in found.fits]
    if free is not None:
        beside = d.decided.beside
        merit = found.merit(beside) + evidence(beside, free) - UNLISTED
        words = f"a force without a name at {here(machine, free.node)}, by {free.axis}"
        if beside.names:
            words += ", beside " + " + ".join(called(machine, n) for n in beside.names)
        entries.append((beside.names, words, merit))
    if not any(names == () and not words for names, words, _ in entries):
        entries.append(((), "", found.merit(found.base)))
    merits = np.array([merit for *_, merit in entries])
    behind = merits - merits.max()
    weights = np.exp(behind) / np.exp(behind).sum()
    bars = [Bar(n, w, float(p), float(b)) for (n, w, _), p, b in zip(entries, weights, behind, strict=True)]
    return sorted(bars, key=lambda bar: -bar.behind)
