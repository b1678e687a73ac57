"""Comparison of two recordings of the same machine: first and largest difference of each signal, and the steps.

The recordings are aligned at the first move of the reference, or by tick numbers. Both are read into memory.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer, UserError, nearest
from rtctl.trace.bundle import PARQUET, Bundle, load_bundle
from rtctl.trace.metrics import scales, settle_floor, step_metrics

Align = Literal["auto", "tick", "reference"]
REFERENCES = ("target", "ref")  # `target` first: it is the reference before shaping and moves without delay
MEASURED = ("capstan", "position", "x", "feedback")  # in order of search
MOVES = 0.01  # share of the reference's span that counts as its first move
RATE_OFF = 1e-3  # share by which the rates may differ
RUNNING = 2  # in the column `state`


class SignalDifference(NamedTuple):
    """B - A of one column over the common ticks, in the column's unit; nan where it is undefined."""

    column: str
    unit: str
    rms: float
    largest: float  # greatest absolute difference
    largest_tick: int  # of A; -1 where no tick differs
    spread: float  # rms of A about its mean, the scale for the differences
    ticks: int  # number of ticks that differ in any bit
    first_tick: int  # of A, first tick that differs; -1 where no tick differs
    first_t: float  # s, of A


class Comparison(NamedTuple):
    a: Bundle
    b: Bundle
    aligned: str  # "tick" or "reference"
    offset: int  # tick of B minus tick of A at the same moment
    rows_a: np.ndarray  # (n,) compared rows of A; rows_b: of B
    rows_b: np.ndarray
    signals: tuple[SignalDifference, ...]
    only_a: tuple[str, ...]  # columns missing in B
    only_b: tuple[str, ...]
    steps_a: list[dict[str, float | None]]  # from `step_metrics`
    steps_b: list[dict[str, float | None]]

    @property
    def same(self) -> bool:
        """Whether both hold the same ticks and columns, identical to the bit."""
        whole = len(self.rows_a) == len(self.a.columns["t"]) == len(self.b.columns["t"])
        return whole and not self.offset and not self.only_a and not self.only_b and not self.different

    @property
    def different(self) -> tuple[SignalDifference, ...]:
        """Signals that differ, ordered by their first tick."""
        return tuple(sorted((s for s in self.signals if s.ticks), key=lambda s: s.first_tick))


def compare(
    a: Path | str | Bundle, b: Path | str | Bundle, columns: Sequence[str] = (), align: Align = "auto"
) -> Comparison:
    """Compare two bundles; `columns` limits it to some.

    `align="tick"` pairs rows with the same tick (the same row number where there are no ticks). "reference" pairs rows
    equally long after the first move of the reference. "auto" is "reference", unless common ticks have the same
    reference or one reference never moves. Raises UserError for an invalid bundle and for different machines or
    rates, NoAnswer where no tick is common.
    """
    a = a if isinstance(a, Bundle) else load_bundle(a)
    b = b if isinstance(b, Bundle) else load_bundle(b)
    _alike(a, b)
    aligned, offset = _offset(a, b, align)
    rows_a, rows_b = np.intersect1d(ticks(a), ticks(b) - offset, return_indices=True)[1:]
    if not len(rows_a):
        raise NoAnswer(f"{a.folder} and {b.folder} have no tick in common when aligned by {aligned}")
    names, only_a, only_b = _names(a, b, columns)
    if aligned == "reference" and offset:
        names = [name for name in names if name not in ("tick", "t", "order")]  # their offsets do not count
    signals = tuple(_difference(a, b, name, rows_a, rows_b) for name in names)
    return Comparison(a, b, aligned, offset, rows_a, rows_b, signals, only_a, only_b, steps(a), steps(b))


def ticks(bundle: Bundle) -> np.ndarray:
    """Tick number of each row (n,); the row number where there is no column `tick`."""
    found = bundle.columns.get("tick")
    return np.arange(len(bundle.columns["t"])) if found is None else found.astype(np.int64)


def steps(bundle: Bundle) -> list[dict[str, float | None]]:
    """Step metrics of a recording while the loop ran; empty where a needed column is missing."""
    columns = bundle.columns
    ref = next((columns[name] for name in REFERENCES if name in columns), None)
    y = next((columns[name] for name in MEASURED if name in columns), None)
    if ref is None or y is None or np.isnan(ref).any():
        return []
    ran = columns["state"] == RUNNING if "state" in columns else np.ones(len(ref), bool)
    try:
        mm, rad = scales(bundle.case)
    except ValueError:
        return []
    floor = settle_floor(bundle.case.get("plant", ""))
    return step_metrics(columns["t"][ran], ref[ran], y[ran], mm, rad, settle_floor=floor) if ran.any() else []


def _alike(a: Bundle, b: Bundle) -> None:
    for key, what in (("plant", "machine"), ("sample_rate", "rate")):
        one, two = a.case.get(key), b.case.get(key)
        if one is None or two is None or one == two:
            continue
        if key == "sample_rate" and abs(float(one) / float(two) - 1) < RATE_OFF:
            continue
        unit = " Hz" if key == "sample_rate" else ""
        raise UserError(
            f"{a.folder} is of {what} {one}{unit} and {b.folder} of {two}{unit}; compare recordings of one {what}"
        )


def _offset(a: Bundle, b: Bundle, align: str) -> tuple[str, int]:
    if align == "tick" or (align == "auto" and _one_reference(a, b)):
        return "tick", 0
    starts = [_start(a), _start(b)]
    if None in starts:
        if align == "reference":
            still = a if starts[0] is None else b
            raise NoAnswer(f"{still.folder}: its reference never moves; only --align tick can align it")
        return "tick", 0
    offset = int(ticks(b)[starts[1]] - ticks(a)[starts[0]])
    return ("reference", offset) if offset or align == "reference" else ("tick", 0)


def _one_reference(a: Bundle, b: Bundle) -> bool:
    """Whether common ticks have the same reference: one recording is a section or a repetition of the other."""
    rows_a, rows_b = np.intersect1d(ticks(a), ticks(b), return_indices=True)[1:]
    name = next((n for n in REFERENCES if n in a.columns and n in b.columns), None)
    return name is not None and len(rows_a) > 0 and bool((a.columns[name][rows_a] == b.columns[name][rows_b]).all())


def _start(bundle: Bundle) -> int | None:
    """First row in which the reference has moved; None where it never moves."""
    for name in REFERENCES:
        ref = bundle.columns.get(name)
        if ref is None or not np.isfinite(ref).all():
            continue
        moved = np.abs(ref - ref[0]) > MOVES * np.ptp(ref)
        if moved.any():
            return int(np.argmax(moved))
    return None


def _names(a: Bundle, b: Bundle, wanted: Sequence[str]) -> tuple[list[str], tuple[str, ...], tuple[str, ...]]:
    for bundle in (a, b):
        for name in wanted:
            if name not in bundle.columns:
                near = nearest(name, bundle.columns)
                hint = f"is it '{near}'?" if near else f"it has {', '.join(bundle.columns)}"
                raise UserError(f"{bundle.folder / PARQUET} has no column '{name}'; {hint}")
    if wanted:
        return list(dict.fromkeys(wanted)), (), ()
    both = [name for name in a.columns if name in b.columns]
    return both, *(tuple(n for n in x.columns if n not in both) for x in (a, b))  # type: ignore[return-value]


def _difference(a: Bundle, b: Bundle, name: str, rows_a: np.ndarray, rows_b: np.ndarray) -> SignalDifference:
    one, two = (np.asarray(x.columns[name][rows], np.float64) for x, rows in ((a, rows_a), (b, rows_b)))
    other = np.flatnonzero(one.view(np.int64) != two.view(np.int64))
    off = np.abs(two - one)
    known = np.isfinite(off)
    at = int(rows_a[other[0]]) if len(other) else None
    worst = int(rows_a[np.nanargmax(np.where(known, off, -1.0))]) if len(other) else None
    return SignalDifference(
        column=name,
        unit=a.units.get(name, ""),
        rms=float(np.sqrt(np.mean(off[known] ** 2))) if known.any() else float("nan"),
        largest=float(off[known].max()) if known.any() else float("nan"),
        largest_tick=-1 if worst is None else int(ticks(a)[worst]),
        spread=float(np.std(one[np.isfinite(one)])) if np.isfinite(one).any() else float("nan"),
        ticks=len(other),
        first_tick=-1 if at is None else int(ticks(a)[at]),
        first_t=float("nan") if at is None else float(a.columns["t"][at]),
    )


def as_dict(found: Comparison) -> dict[str, Any]:
    """A comparison as a JSON object."""
    return {
        "a": str(found.a.folder),
        "b": str(found.b.folder),
        "aligned": found.aligned,
        "offset_ticks": found.offset,
        "ticks": len(found.rows_a),
        "same": found.same,
        "signals": [s._asdict() for s in found.signals],
        "only_a": list(found.only_a),
        "only_b": list(found.only_b),
        "steps": {"a": found.steps_a, "b": found.steps_b},
    }
