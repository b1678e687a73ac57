"""What a recording can show, looked at before any model is fitted: clock, counters, drives, motion, excitation.

Statistics are medians and quantiles, so that a few bad rows change nothing. `cannot_test` lists what this record leaves
open whatever the machine has: a gain for each sign cannot be seen where a drive only ever had one sign.

What a record must contain to show an effect is told by its term (`Needs` in plants/physics/story.py). Source of the
rules: what each effect does to the equations of plants/; what is periodic needs half a turn, or two periods.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.signal import welch

from rtctl.diagnose.case import NoLaw, believed
from rtctl.diagnose.columns import unwrap
from rtctl.diagnose.quantities import node_words, of_case
from rtctl.diagnose.record import Record, law_agreement
from rtctl.diagnose.simulate import way
from rtctl.diagnose.tacho import counts_up, unsigned
from rtctl.plants.physics import TERMS, Term, elements, met, nodes

LOOK = 0.02  # s over which a speed is a difference
SOME = 0.005  # share of the rows below which something counts as not there
CRAWL = 0.1  # of the high speed
NEAR_LIMIT = 0.1  # share of the limit that a command must pass to say anything of saturation
NEAR_ZERO = 0.01  # share of the limit that counts as zero command
STEADY = 1.2  # ratio of high to low speed below which viscous and dry friction are one


class Shaft(NamedTuple):
    """One thing that turns (or slides) and the nodes that turn with it."""

    name: str
    q: np.ndarray  # (n,) rad, or m for what slides
    quantum: float  # the sensor's step in that unit
    nodes: tuple[str, ...]
    turns: bool  # False: slides
    fine: np.ndarray | None = None  # (n,) a finer reading of the same motion, for speeds, with its step
    fine_quantum: float = 0.0


class Motion(NamedTuple):
    turns: float  # span in turns, or metres for what slides
    high_speed: float  # 95 % of the speeds while it moves, per s
    low_speed: float  # 5 %
    forward: float  # share of rows
    backward: float
    standstill: float
    crawl: float  # moves, but below a tenth of the high speed
    reversals: int


@dataclass(frozen=True)
class Preflight:
    findings: tuple[str, ...]
    numbers: dict[str, Any] = field(default_factory=dict)
    cannot_test: list[str] = field(default_factory=list)  # "name:node"


def preflight(record: Record) -> Preflight:
    """Findings in sentences, the numbers behind them, and what cannot be tested. Numbers are SI, shares 0 to 1."""
    findings: list[str] = []
    numbers: dict[str, Any] = {"rows": len(record.t), "seconds": float(record.t[-1] - record.t[0])}
    cannot: list[str] = []
    _clock(record, findings, numbers)
    _counters(record, findings, numbers)
    _law(record, findings, numbers)
    for d, name in enumerate(record.commands):
        drive = f"drive{d + 1}" if record.plant == "ivu" else "drive"
        _drive(record, d, name, drive, findings, numbers, cannot)
    for shaft in shafts(record):
        _shaft(record, shaft, findings, numbers, cannot)
    _sensors(record, findings, cannot)
    _spectrum(record, findings, numbers)
    if cannot:
        findings.append(f"This record cannot show {len(cannot)} of the effects that a machine may have.")
    return Preflight(tuple(findings), numbers, sorted(set(cannot)))


def shafts(record: Record) -> list[Shaft]:
    """What turns or slides in this record, from its sensors. The reels' counters get their sign from the capstan."""
    case, y = record.case, record.y
    p = believed(case)
    if record.plant == "ivu":
        step = 2 * np.pi / _given(case.sensors.capstan_counts_per_rev)
        capstan = y["capstan_counts"] * step
        found = [Shaft("capstan", capstan, step, ("capstan", "encoder"), True)]
        tooth = 2 * np.pi / _given(case.sensors.reel_counts_per_rev)
        for i, sign in ((1, 1.0), (2, -1.0)):
            angle = sign * tooth * signed_counts(y[f"reel{i}_counts"], y["capstan_counts"], _look(record))
            ratio = sign * p["R_c"] / p[f"R{i}"]  # the tape says how a reel turns, finer than its own 209 a turn
            both = (f"motor{i}", f"reel{i}")
            found.append(Shaft(f"reel{i}", angle, tooth, both, True, capstan * ratio, step * abs(ratio)))
        return found
    if record.plant == "ldu":
        step = 2 * np.pi / _given(case.sensors.encoder_counts_per_rev)
        turned = y["encoder_counts"] * step
        return [
            Shaft("capstan", turned, step, ("wheel", "capstan", "encoder"), True),
            Shaft("motor", turned * p["N"], step * p["N"], ("motor",), True),
            Shaft("carriage", turned * p["R_c"], step * p["R_c"], ("carriage",), False),
        ]
    q = way(record)
    rotary = of_case(case).rotary
    per_rev = case.sensors.x_counts_per_rev
    quantum = 2 * np.pi / per_rev if per_rev and rotary else (case.sensors.x_resolution_m or _smallest_step(q))
    return [Shaft("carriage", q, quantum, ("carriage", "sensor"), rotary)]


def signed_counts(counts: np.ndarray, guide: np.ndarray, look: int) -> np.ndarray:
    """A counter (n,) that counts up in either direction, with the sign of a guide's motion over `look` rows."""
    k = np.arange(len(guide))
    moved = guide[np.minimum(k + look, len(k) - 1)] - guide[np.maximum(k - look, 0)]
    sign = np.sign(moved)
    filled = np.maximum.accumulate(np.where(sign != 0, k, 0))  # at rest: as it last moved
    return np.concatenate(([0.0], np.cumsum(np.diff(counts) * sign[filled][1:])))


def motion(record: Record, shaft: Shaft) -> Motion:
    """How the shaft moved; a speed is a difference over 20 ms, and below two of the sensor's steps it is standstill."""
    look = _look(record)
    q, quantum = (shaft.q, shaft.quantum) if shaft.fine is None else (shaft.fine, shaft.fine_quantum)
    v = (q[look:] - q[:-look]) / (record.t[look:] - record.t[:-look])
    still = 2.0 * quantum / (look * record.dt)
    moving = np.abs(v) >= still
    speeds = np.abs(v[moving]) if moving.any() else np.zeros(1)
    low, high = (float(x) for x in np.quantile(speeds, (0.05, 0.95)))
    signs = np.sign(v[moving])
    span = float(np.ptp(shaft.q))
    return Motion(
        turns=span / (2 * np.pi) if shaft.turns else span,
        high_speed=high,
        low_speed=low,
        forward=float(np.mean(moving & (v > 0))),
        backward=float(np.mean(moving & (v < 0))),
        standstill=float(np.mean(~moving)),
        crawl=float(np.mean(moving & (np.abs(v) < CRAWL * high))),
        reversals=int(np.count_nonzero(np.diff(signs))),
    )


def jumps(values: np.ndarray, quantum: float, t: np.ndarray | None = None) -> np.ndarray:
    """Rows (m,) at which a reading steps by more than its neighbours allow: counts lost or gained all at once.

    `t` (n,) s makes up for an uneven clock. A step is compared with the mean of the one before and the one after, and
    what is left with the same of rows 2 to 10 away.
    """
    if len(values) < 32:
        return np.zeros(0, int)
    d = np.diff(values)
    if t is not None:
        ticks = np.diff(t)
        d = d * (np.median(ticks) / ticks)
    off = np.zeros_like(d)
    off[1:-1] = np.abs(d[1:-1] - 0.5 * (d[:-2] + d[2:]))
    most = maximum_filter1d(off, 9, mode="nearest")
    around = np.maximum(np.roll(most, 6), np.roll(most, -6))
    return np.flatnonzero(off > 3.0 * around + 4.0 * quantum) + 1


def band(signal: np.ndarray, dt: float) -> tuple[float, float] | None:
    """Hz between which nine tenths of a signal's power lie; None for a constant."""
    if np.isnan(signal).any() or np.ptp(signal) == 0.0:
        return None
    f, p = welch(signal, 1.0 / dt, nperseg=min(len(signal), 8192), detrend="linear")
    total = np.cumsum(p)
    low, high = np.searchsorted(total / total[-1], (0.05, 0.95))
    return float(f[low]), float(f[min(int(high), len(f) - 1)])


def _clock(record: Record, findings: list[str], numbers: dict[str, Any]) -> None:
    uneven = record.case.sample_rate is None
    rows = np.asarray(record.columns["t"], float) if uneven and "t" in record.columns else record.t
    d = np.diff(rows)
    median = float(np.median(d))
    jitter = 1.4826 * float(np.median(np.abs(d - median))) / median
    limit = 1.5 * record.dt if record.case.sample_rate is not None else 5.0 * median
    gaps = np.flatnonzero(d > limit)
    lost = int(np.sum(np.round(d[gaps] / record.dt) - 1))
    numbers["clock"] = {
        "tick": median,
        "jitter": jitter,
        "p99": float(np.quantile(np.abs(d - median), 0.99)) / median,
        "longest": float(d.max()),
        "gaps": len(gaps),
        "rows_lost": lost,
    }
    if len(gaps):
        k = int(gaps[0])
        findings.append(
            f"The clock has {len(gaps)} gaps, {lost} rows are missing; the first after row {k} at {rows[k]:.3f} s."
        )
    if jitter > 0.01:
        findings.append(f"The clock is uneven: ticks differ from {1e3 * median:.4g} ms by {100 * jitter:.2g} %.")
    if uneven:
        numbers["clock"]["rows_even"] = len(record.t)
        findings.append(
            f"Its {len(rows)} rows, {1e3 * d.min():.3g} to {1e3 * d.max():.3g} ms apart, were laid onto "
            f"{len(record.t)} rows {1e3 * record.dt:.4g} ms apart."
        )


def _counters(record: Record, findings: list[str], numbers: dict[str, Any]) -> None:
    for name, values in record.y.items():
        entry: dict[str, Any] = {}
        counter = name.endswith("_counts")
        if counter and name in record.columns:
            _, bits, wraps = unwrap(np.asarray(record.columns[name], float))
            entry["wraps"] = wraps
            if bits is not None:
                findings.append(f"{name} wrapped {wraps} times, as a counter of {bits} bits does; it was unwrapped.")
        rows = jumps(values, 1.0 if counter else _smallest_step(values), record.t)
        entry["jumps"] = [int(k) for k in rows[:100]]
        if len(rows):
            size = values[rows[0]] - values[rows[0] - 1]
            findings.append(
                f"{name} jumps {len(rows)} times beyond what its neighbours allow, first in row {rows[0]} by {size:g}."
            )
        numbers[name] = entry


def _law(record: Record, findings: list[str], numbers: dict[str, Any]) -> None:
    agreement, replay = law_agreement(record), record.replay
    if replay is not None and replay.rows:
        numbers["law"] = {"replayed": replay.rows, "exact": replay.identical, "holds": replay.identical}
        findings.append(f"{replay.words[:1].upper()}{replay.words[1:]}.")
        return
    if agreement is None:
        why = "There is no loop" if isinstance(record.case.controller, NoLaw) else "No law can be recomputed"
        findings.append(f"{why}: the recorded command is the input.")
        return
    numbers["law"] = {**agreement._asdict(), "exact": agreement.exact, "holds": agreement.holds}
    unit = of_case(record.case).command
    if agreement.exact:
        findings.append("The law recomputed from the recorded columns gives the recorded command exactly.")
    else:
        findings.append(
            f"The recomputed law {'nearly gives' if agreement.holds else 'does not give'} the recorded command: "
            f"{100 * agreement.nrmse:.2g} % rms, at worst {agreement.worst:.3g} {unit} in row {agreement.worst_row}."
        )


def _drive(
    record: Record, d: int, name: str, node: str, findings: list[str], numbers: dict[str, Any], cannot: list[str]
) -> None:
    u = record.u[:, d]
    drive = record.case.drive
    limit = drive.limit_volt
    top = float(np.abs(u).max())
    step = drive.step_volt or 0.0
    clipped = 0.0 if limit is None else float(np.mean(np.abs(u) >= limit - 1.01 * step))
    zero = NEAR_ZERO * (limit or top)
    positive, negative = float(np.mean(u > 0)), float(np.mean(u < 0))
    numbers[node] = {
        "positive": positive,
        "negative": negative,
        "near_zero": float(np.mean(np.abs(u) <= zero)),
        "highest": top,
        "clipped": clipped,
        "median": float(np.median(u)),
        "spread": float(np.subtract(*np.quantile(u, (0.84, 0.16))) / 2),
    }
    unit = drive.unit
    if clipped > 0:
        findings.append(f"{name} is clipped at {limit:g} {unit} in {100 * clipped:.2g} % of the rows.")
    if np.ptp(u) == 0.0:
        findings.append(f"{name} is constant, {u[0]:g} {unit}: this drive is not excited.")
        _add(record, cannot, [term for term in TERMS.values() if term.needs.command], (node,))
        return
    if min(positive, negative) < SOME:
        findings.append(f"{name} is never {'negative' if positive > negative else 'positive'}.")
        missing = ("signs", "small") if numbers[node]["near_zero"] < SOME else ("signs",)
        _add(record, cannot, [term for term in TERMS.values() if term.needs.command in missing], (node,))
    if limit is not None and top < NEAR_LIMIT * limit:
        findings.append(f"{name} stays below {top:.3g} {unit} of {limit:g}: a limit above that cannot be seen.")
        _add(record, cannot, [term for term in TERMS.values() if term.needs.command == "large"], (node,))


def _shaft(record: Record, shaft: Shaft, findings: list[str], numbers: dict[str, Any], cannot: list[str]) -> None:
    m = motion(record, shaft)
    unit = "turns" if shaft.turns else "m"
    called = node_words(shaft.name, of_case(record.case))
    called = called[:1].upper() + called[1:]
    numbers[shaft.name] = {**m._asdict(), "unit": unit}
    if shaft.turns:
        for term in (term for term in TERMS.values() if m.turns < term.needs.turns):
            there = met(term.needs.turned or term.stands, record.plant)
            cannot += [f"{term.name}:{node}" for node in there if node in shaft.nodes]
    if shaft.turns and m.turns < 1.0:
        findings.append(f"{called} turns {m.turns:.2f} of a turn only; what repeats each turn is hard to see.")
    blind = unsigned(record) or counts_up(record)
    if blind:
        what = "speed" if record.shows_speed else "rate of the position"
        findings.append(f"The {what} never goes below zero although the command pushes both ways.")
    one_way = min(m.forward, m.backward) < SOME and not blind
    bodies = {e.node for e in elements(record.plant) if e.kind == "body"}
    mechanical = [node for node in shaft.nodes if node in bodies]
    commands = record.u[:, 0 if shaft.name != "reel2" else 1]
    pushed_both_ways = min(np.mean(commands > 0), np.mean(commands < 0)) >= SOME
    if one_way:
        findings.append(f"{called} moves one way only.")
        _add(record, cannot, [term for term in TERMS.values() if term.needs.ways == "motion"], shaft.nodes)
        if not pushed_both_ways:
            _add(record, cannot, [term for term in TERMS.values() if term.needs.ways == "push"], mechanical)
    if m.standstill + m.crawl < SOME:
        findings.append(f"{called} neither stands still nor crawls.")
        _add(record, cannot, [term for term in TERMS.values() if term.needs.slow], mechanical)
    if 0.0 < m.high_speed < STEADY * m.low_speed:
        findings.append(f"{called} has one speed only: dry and viscous friction are one.")
        _add(record, cannot, [term for term in TERMS.values() if term.needs.speeds], mechanical)


def _sensors(record: Record, findings: list[str], cannot: list[str]) -> None:
    if record.plant == "ldu" and "scale_counts" not in record.y:
        findings.append("No scale is mounted: what happens between capstan and carriage is unseen.")
    if len(record.y) < 2:  # nothing to compare the only sensor with
        cannot += [f"{name}:{node}" for name, term in TERMS.items() for node in met(term.needs.second, record.plant)]


def _spectrum(record: Record, findings: list[str], numbers: dict[str, Any]) -> None:
    bands = {"ref": band(record.ref, record.dt), "w": band(np.nan_to_num(record.w), record.dt)}
    bands |= {name: band(record.u[:, d], record.dt) for d, name in enumerate(record.commands)}
    numbers["bands_hz"] = {name: list(b) for name, b in bands.items() if b is not None}
    if bands["w"] is None:
        findings.append("There is no excitation beside the reference.")
    else:
        findings.append(f"The excitation has its power between {bands['w'][0]:.3g} and {bands['w'][1]:.3g} Hz.")


def _add(record: Record, cannot: list[str], terms: Iterable[Term], among: Sequence[str]) -> None:
    """Each of the terms at those of the nodes `among` where it can stand."""
    cannot += [f"{term.name}:{node}" for term in terms for node in nodes(term, record.plant) if node in among]


def _look(record: Record) -> int:
    return max(1, min(round(LOOK / record.dt), len(record.t) // 4))


def _smallest_step(values: np.ndarray) -> float:
    d = np.abs(np.diff(values))
    return float(d[d > 0].min()) if (d > 0).any() else 1.0


def _given(value: float | None) -> float:
    assert value is not None  # load_record has seen to it
    return value
