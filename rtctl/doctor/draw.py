"""Latency histograms in characters: lateness on a log axis to the right, wake-ups on a log axis upwards."""

import math
from typing import NamedTuple

import numpy as np

from rtctl.doctor.measure import Lateness, edges

EIGHTHS = " " + "".join(map(chr, range(0x2581, 0x2589)))  # blocks of one to eight eighths (Unicode 1.1)
RULE = chr(0x2502)
MARKS = (("p50", "50"), ("p99", "99"), ("p999", "99.9"), ("max", "max"))
HEIGHT, LEAST, MOST = 6, 24, 96  # lines, and characters of the plot's width


class Axis(NamedTuple):
    """A log axis of lateness over `columns` characters, whole decades wide."""

    low: int  # ns, as power of ten
    high: int
    columns: int

    def column(self, ns: float) -> int:
        """Index of the character for a lateness in ns."""
        share = (math.log10(max(ns, 1.0)) - self.low) / (self.high - self.low)
        return min(max(int(share * self.columns), 0), self.columns - 1)


def axis(histograms: list[Lateness], width: int) -> Axis:
    """Common axis of the histograms, as wide as a terminal of `width` characters allows."""
    first = min(float(edges()[np.flatnonzero(h.record["bucket"])[0]]) for h in histograms)
    last = max(float(h.record["max"]) for h in histograms)
    low, high = math.floor(math.log10(max(first, 100.0))), math.floor(math.log10(max(last, 1000.0))) + 1
    return Axis(low, high, min(max(width - 9, LEAST), MOST))


def lines(h: Lateness, axis: Axis, blocks: bool = True) -> list[str]:
    """Lines of the histogram with labelled marks at p50, p99, p99.9 and max; with blocks or plain characters."""
    count = per_column(h, axis)
    decades = max(math.ceil(math.log10(count.max() + 1)), 1)
    tall = np.where(count > 0, np.maximum(np.log10(np.maximum(count, 1)) / decades * 8 * HEIGHT, 1), 0).astype(int)
    at = {axis.column(1000 * h.us[name]): label for name, label in MARKS}
    out = [f"{'':8}{row}" for row in labels(at)]
    for line in reversed(range(HEIGHT)):
        eighths = np.clip(tall - 8 * line, 0, 8)
        row = [
            (EIGHTHS[e] if blocks else "#" if e >= 4 or (e and not line) else " ") if e else _line(c in at, blocks)
            for c, e in enumerate(eighths)
        ]
        left = f"{10**decades:g}" if line == HEIGHT - 1 else "1" if line == 0 else ""
        out.append(f"{left:>6} |{''.join(row)}".rstrip())
    return out


def foot(axis: Axis) -> list[str]:
    """Lines of the axis with its decades."""
    rule, words = ["-"] * axis.columns, [" "] * axis.columns
    for decade in range(axis.low, axis.high + 1):
        column = round((decade - axis.low) / (axis.high - axis.low) * axis.columns)
        if column < axis.columns:
            rule[column] = "+"
        text = unit(10.0**decade)
        start = min(column, len(words) - len(text))
        if all(w == " " for w in words[max(start - 1, 0) : start + len(text) + 1]):
            words[start : start + len(text)] = text
    return [f"{'':7}{''.join(rule)}", f"{'':7}{''.join(words)}".rstrip()]


def unit(ns: float) -> str:
    """Text of a time in the largest unit that fits."""
    for size, word in ((1e9, "s"), (1e6, "ms"), (1e3, "us")):
        if ns >= size:
            return f"{ns / size:g} {word}"
    return f"{ns:g} ns"


def per_column(h: Lateness, axis: Axis) -> np.ndarray:
    """Number of wake-ups in each character of the axis, (columns,)."""
    buckets, starts = h.record["bucket"], edges()
    count = np.zeros(axis.columns, np.int64)
    for i in np.flatnonzero(buckets):
        end = starts[i + 1] if i + 1 < len(starts) else starts[i] + 1
        low, high = axis.column(float(starts[i])), axis.column(min(float(end) - 1, float(h.record["max"])))
        share = np.diff(np.linspace(0, int(buckets[i]), max(high - low, 0) + 2).astype(int))  # spread wide buckets
        count[low : low + len(share)] += share
    return count


def labels(at: dict[int, str]) -> list[str]:
    """Rows of labels above their columns: one row, or more where labels would touch."""
    rows: list[str] = []
    for column, label in sorted(at.items()):
        row = next((r for r, text in enumerate(rows) if len(text) < column), len(rows))
        if row == len(rows):
            rows.append("")
        rows[row] = rows[row].ljust(column) + label
    return rows[::-1]


def _line(marked: bool, blocks: bool) -> str:
    return (RULE if blocks else "|") if marked else " "
