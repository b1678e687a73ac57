"""Posterior of a diagnosis as a list: combinations of effects, the nominal model alone, and unnamed effects."""

from typing import NamedTuple

from rtctl.diagnose.answer.answer import GraphDiagnosis
from rtctl.diagnose.answer.words import called, here
from rtctl.diagnose.evidence.evidence import Rival


class Bar(NamedTuple):
    """Rival with its probability."""

    names: tuple[str, ...]  # term:node
    free: str  # unnamed effect in words; "" for none
    probability: float
    behind: float  # ln of its posterior over that of the likeliest rival, on the whole recording


def rivals(d: GraphDiagnosis) -> list[Bar]:
    """Rivals, likeliest first; probabilities sum to one. Free functions along one axis are one rival."""
    return [bar for bar, _ in groups(d)]


def groups(d: GraphDiagnosis) -> list[tuple[Bar, Rival]]:
    """Rivals as by `rivals`, each with the likeliest of its models."""
    machine = d.record.case.machine
    found: dict[tuple[tuple[str, ...], str], list[Rival]] = {}
    for rival in d.decided.table:
        words = f"a wrong {rival.doubted}" if rival.unlisted and rival.doubted else ""
        if rival.unlisted and rival.free is not None:
            words = f"{rival.free.kind} without a name at {here(machine, rival.free.node)}, by {rival.free.axis}"
        if words and rival.fit.names:
            words += ", beside " + " + ".join(called(machine, n) for n in rival.fit.names)
        found.setdefault((rival.fit.names, words), []).append(rival)
    top = max(rival.merit for rival in d.decided.table)
    out = []
    for (names, words), same in found.items():
        best = max(same, key=lambda rival: rival.merit)
        out.append((Bar(names, words, sum(r.probability for r in same), best.merit - top), best))
    return sorted(out, key=lambda pair: (-pair[0].probability, -pair[0].behind))


def in_words(d: GraphDiagnosis, bar: Bar) -> str:
    """Rival in words."""
    machine = d.record.case.machine
    return bar.free or " + ".join(called(machine, n) for n in bar.names) or "the description alone"
