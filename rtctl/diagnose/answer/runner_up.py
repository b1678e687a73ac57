"""Why the next likeliest answer lost: what each part of a recording says for the answer and against it."""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.answer.answer import GraphDiagnosis
from rtctl.diagnose.answer.posterior import Bar, groups, in_words
from rtctl.diagnose.answer.si_format import percent
from rtctl.diagnose.evidence.diagnosis import NOTHING, UNNAMED
from rtctl.diagnose.evidence.evidence import losses_of

HALF = 0.5  # of what speaks for the answer: the parts that are named
LEAST_SHARE = 0.001  # probability that is told
CLOSE = 1.0  # nats: less is told as about even


class Lost(NamedTuple):
    """The next likeliest answer beside the one that was given."""

    other: str  # in words
    share: float  # its probability over resampled segments
    behind: float  # nats: ln of the odds of the answer against it, on the whole recording
    edges: np.ndarray  # (parts + 1,) of the parts, s; of several recordings shares of all their rows, 0 to 1
    nats: np.ndarray  # (parts,) for the answer


def lost_by(d: GraphDiagnosis) -> Lost | None:
    """What the next likeliest answer lost by; None where there is no other."""
    found = groups(d)
    own = next((pair for pair in found if answers(d, pair[0])), found[0])
    others = [pair for pair in found if pair is not own]
    if not others:
        return None
    (bar, one), (other, two) = own, others[0]
    power = d.found.base.power
    nats = losses_of(power, two.fit, two.free) - losses_of(power, one.fit, one.free)
    parts = np.linspace(0.0, 1.0, len(nats) + 1)
    begin, end = d.found.like.rows
    edges = parts if len(d.records) > 1 else (begin + parts * (end - begin)) * d.record.dt
    return Lost(in_words(d, other), other.probability, bar.behind - other.behind, edges, nats)


def answers(d: GraphDiagnosis, bar: Bar) -> bool:
    """Whether a rival is the answer that was given."""
    if d.verdict == UNNAMED:
        return bool(bar.free)
    return not bar.free and bar.names == (() if d.verdict == NOTHING else d.decided.best.names)


def sentence(d: GraphDiagnosis) -> str:
    """The next likeliest answer, by how much it is behind, and when it lost that; "" where there is none."""
    lost = lost_by(d)
    if lost is None:
        return ""
    said = f"The next likeliest answer is {lost.other}."
    if lost.behind < CLOSE:
        return f"{said} It is about as probable: the recording does not tell the two apart."
    digits = lost.behind / np.log(10.0)
    odds = f"10^{digits:.0f}" if digits > 4.0 else f"{np.exp(lost.behind):.0f}"
    said += f" On the recording as a whole the odds against it are {odds} to 1"
    said += f"; over resampled segments it has {percent(lost.share)}." if lost.share >= LEAST_SHARE else "."
    return f"{said} {when(lost, len(d.records))}".strip()


def when(lost: Lost, recordings: int) -> str:
    """The parts of one recording in which the other answer lost most, or what it loses by if not there."""
    total = float(lost.nats.sum())
    if total < CLOSE:
        return "The rows do not decide between them: it has more numbers, or less probable ones."
    if recordings > 1:
        return ""
    order = np.argsort(-lost.nats)
    most = order[: int(np.searchsorted(np.cumsum(lost.nats[order]), HALF * total)) + 1]
    spans = [f"{lost.edges[a]:.3g} to {lost.edges[b + 1]:.3g} s" for a, b in runs(np.sort(most))]
    if len(spans) > 3:
        return "It loses in many parts of the recording, a little in each."
    return f"It loses half of that in the rows from {' and '.join(spans)}."


def runs(numbers: np.ndarray) -> list[tuple[int, int]]:
    """First and last of each run of neighbours among numbers in rising order."""
    cuts = np.flatnonzero(np.diff(numbers) > 1)
    firsts, lasts = numbers[np.r_[0, cuts + 1]], numbers[np.r_[cuts, len(numbers) - 1]]
    return [(int(a), int(b)) for a, b in zip(firsts, lasts, strict=True)]
