"""Report of all findings, as sentences and as one JSON object."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rtctl.doctor.facts import changes
from rtctl.doctor.finding import Finding, Tree
from rtctl.doctor.measure import MOST_LATE, Lateness, Measured, Rate, edges, words
from rtctl.doctor.spin import advice


def sentence(rate: Rate) -> str:
    """Sentence on whether this computer can hold a rate, with the count of late ticks."""
    share = f" ({100 * rate.late / rate.ours.ticks:.2g} %)" if rate.late else ""
    return (
        f"This machine {'can' if rate.held else 'cannot'} hold {words(rate.hz)}: a wake-up later than half a period "
        f"({5e5 / rate.hz:g} us) happened in {rate.late} of {rate.ours.ticks} ticks{share}."
    )


def figures(h: Lateness) -> str:
    """Text with percentiles in us and the number of late ticks."""
    digits = {name: f"{us:.1f}" if us < 100 else f"{us:.0f}" for name, us in h.us.items()}
    late = "" if h.late is None else f"; {h.late} of {h.ticks} late"
    late += f", {h.skipped} skipped" if h.skipped else ""
    return f"p50 {digits['p50']}  p99 {digits['p99']}  p99.9 {digits['p999']}  max {digits['max']} us{late}"


def title(tree: Tree) -> str:
    """Line with host and kernel."""
    release, version = tree.read("proc/sys/kernel/osrelease"), tree.read("proc/sys/kernel/version")
    return f"{tree.read('proc/sys/kernel/hostname') or 'this machine'}: Linux {release or '?'} {version or ''}".rstrip()


def as_json(tree: Tree, findings: Sequence[Finding], measured: Measured | None, need: float | None) -> dict[str, Any]:
    """JSON object of checks, histograms, sentences, changes in the order of gain, and whether `need` (Hz) held."""
    out: dict[str, Any] = {
        "host": tree.read("proc/sys/kernel/hostname"),
        "kernel": tree.read("proc/sys/kernel/osrelease"),
        "facts": [f._asdict() for f in findings],
        "change": [f.name for f in changes(list(findings))],
        "measured": None,
        "spin": None,
        "need": None,
    }
    if measured is not None:
        spin = advice(list(findings), measured.rates)
        out["spin"] = None if spin is None else spin._asdict()
        out["measured"] = {
            "cpu": measured.cpu,
            "priority": measured.priority,
            "window_s": measured.window_s,
            "rounds": measured.rounds,
            "lacks": measured.lacks,
            "without_cyclictest": measured.without,
            "most_late": MOST_LATE,
            "rates": [_rate(rate) for rate in measured.rates],
        }
        if need is not None:
            held = next(rate.held for rate in measured.rates if rate.hz == need)
            out["need"] = {"rate_hz": need, "held": held}
    return out


def _rate(rate: Rate) -> dict[str, Any]:
    return {
        "rate_hz": rate.hz,
        "held": rate.held,
        "late": rate.late,
        "half_period_us": 5e5 / rate.hz,
        "sentence": sentence(rate),
        "rtctl": _lateness(rate.ours),
        "cyclictest": None if rate.cyclictest is None else _lateness(rate.cyclictest),
    }


def _lateness(h: Lateness) -> dict[str, Any]:
    filled = np.flatnonzero(h.record["bucket"])
    return {
        "ticks": h.ticks,
        "late": h.late,
        "skipped": h.skipped,
        "lateness_us": h.us,
        "histogram": {
            "from_us": (edges()[filled] / 1000).tolist(),
            "count": h.record["bucket"][filled].tolist(),
        },
    }
