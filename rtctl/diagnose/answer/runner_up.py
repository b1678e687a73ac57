"""Next likeliest answer: gain of the answer over it in each part of a recording, nats."""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.answer.answer import GraphDiagnosis
from rtctl.diagnose.answer.posterior import Bar, groups, in_words
from rtctl.diagnose.answer.si_format import percent
from rtctl.diagnose.evidence.diagnosis import NOTHING, UNNAMED
from rtctl.diagnose.evidence.evidence import losses_of

HALF = 0.5  # of the gain: share of the parts that are named
LEAST_SHARE = 0.001  # least reported probability
CLOSE = 1.0  # nats, gain below which the answers are reported as about equally probable


class Lost(NamedTuple):
    """Next likeliest answer compared with the answer."""

    other: str  # in words
    share: float  # its probability over resampled segments
    behind: float  # nats: ln of the odds of the answer against it, on the whole recording
    edges: np.ndarray  # (parts + 1,) edges of the parts, s; for several recordings shares of all rows, 0 to 1
    nats: np.ndarray  # (parts,) gain of the answer


def lost_by(d: GraphDiagnosis) -> Lost | None:
    """Comparison of the next likeliest answer with the answer; None where there is no other."""
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
    """Whether a rival is the answer of the diagnosis."""
    if d.verdict == UNNAMED:
        return bool(bar.free)
    return not bar.free and bar.names == (() if d.verdict == NOTHING else d.decided.best.names)


def sentence(d: GraphDiagnosis) -> str:
    """Sentences on the next likeliest answer: its odds, and the time of its losses; "" where there is none."""
    lost = lost_by(d)
    if lost is None:
        return ""
    said = f"The next likeliest answer is {lost.other}."
    if lost.behind < CLOSE:
        return f"{said} It is about as probable: the recording does not separate the two."
    digits = lost.behind / np.log(10.0)
    odds = f"10^{digits:.0f}" if digits > 4.0 else f"{np.exp(lost.behind):.0f}"
    said += f" On the recording as a whole the odds against it are {odds} to 1"
    said += f"; over resampled segments it has {percent(lost.share)}." if lost.share >= LEAST_SHARE else "."
    return f"{said} {when(lost, len(d.records))}".strip()


def when(lost: Lost, recordings: int) -> str:
    """Sentence on the parts of one recording in which the other answer lost most, or on its lower prior."""
    total = float(lost.nats.sum())
    if total < CLOSE:
        return "The rows do not decide between the two: the other answer has more numbers, or less probable ones."
    if recordings > 1:
        return ""
    order = np.argsort(-lost.nats)
    most = order[: int(np.searchsorted(np.cumsum(lost.nats[order]), HALF * total)) + 1]
    spans = [f"{lost.edges[a]:.3g} to {lost.edges[b + 1]:.3g} s" for a, b in runs(np.sort(most))]
    if len(spans) > 3:
        return "The evidence against it is spread over many parts of the recording."
    return f"Half of the evidence against it is in the rows from {' and '.join(spans)}."


def runs(numbers: np.ndarray) -> list[tuple[int, int]]:
    """First and last of each run of consecutive numbers among rising ones."""
    cuts = np.flatnonzero(np.diff(numbers) > 1)
    firsts, lasts = numbers[np.r_[0, cuts + 1]], numbers[np.r_[cuts, len(numbers) - 1]]
    return [(int(a), int(b)) for a, b in zip(firsts, lasts, strict=True)]
