"""Sizes and parameters of a fitted model with their 90 % intervals, in the units of the report."""

import numpy as np

from rtctl.case.start import FIRST_POSITION, FIRST_SPEED, OWN_START, is_start
from rtctl.diagnose.answer import words
from rtctl.diagnose.evidence.diagnosis import Interval
from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.widths import along, half_widths
from rtctl.diagnose.model.model import RECORDING
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.model.space import COSINE, INVERSE, PLACE, REST, SHAPE, SINE, SIZE


def sizes(f: Fitted, index: int, spread: np.ndarray) -> dict[str, Interval]:
    """Sizes of one effect with 90 % intervals, by parameter; `spread` (unknowns,) are the half widths."""
    h, columns = f.space.hypotheses[index], f.space.columns(index)
    x, half = f.x[columns], spread[columns]
    values, machine = h.values(x), f.like.sim.case.machine
    out: dict[str, Interval] = {}
    for i, c in enumerate(h.coordinates):
        if c.kind == SINE:
            continue
        name = c.name.partition("|")[0]
        value, unit = values[name], words.unit_at(machine, h.term, h.node, name)
        if c.kind == SHAPE:
            low, high = value * float(np.exp(-half[i])), value * float(np.exp(half[i]))
        elif c.kind in (SIZE, PLACE):
            low, high = value - c.scale * half[i], value + c.scale * half[i]
        elif c.kind == COSINE:
            reach = c.scale * along(x[i : i + 2], half[i : i + 2])[1]
            low, high = max(value - reach, 0.0), value + reach
        elif c.kind == INVERSE:  # a limit, fitted as its inverse
            low, high = c.scale / (x[i] + half[i]), c.scale / max(x[i] - half[i], 1e-3 * x[i])
        elif c.kind == REST:  # a force at rest, over the stiffness before it
            reach = abs(c.scale * half[i] / values[h.coordinates[i - 1].name])
            low, high = value - reach, value + reach
        else:
            low = high = value
        out[name] = Interval(value, float(low), float(high), unit)
    return out


def parameters(f: Fitted, record: GraphRecord) -> dict[str, Interval]:
    """Parameters of the description with 90 % intervals, by path or by symbol."""
    out, spread = {}, half_widths(f)
    lowest, highest = f.space.bounds()  # by the tolerance
    for i, path in enumerate(f.space.names):
        if path.startswith(OWN_START):
            continue
        value, nominal = f.model.base[path], f.space.owner.base[path]
        ends = np.clip((f.x[i] - spread[i], f.x[i] + spread[i]), lowest[i], highest[i])
        low, high = sorted(nominal * float(np.exp(end)) for end in ends)
        plain, _, name = path.partition(RECORDING)
        if is_start(plain) and plain not in (FIRST_POSITION, FIRST_SPEED):  # kept as its exponential
            value, low, high = (float(np.log(v)) for v in (value, low, high))
        elif is_start(plain):
            first = next(p.sim.record for p in f.like.parts if p.sim.record.name == name)
            value, low, high = first_of(first, plain, (value, low, high))
        out[record.case.called.get(path, path)] = Interval(value, low, high, words.unit_in(record, path))
    return out


def first_of(record: GraphRecord, path: str, values: tuple[float, ...]) -> tuple[float, ...]:
    """First position or speed of a free response, SI, from the exponentials of its unknowns."""
    place, rate, guess = record.scales
    x = record.y[record.main][0]
    scale, offset = (place, x) if path == FIRST_POSITION else (rate, guess)
    return tuple(float(offset + scale * np.log(v)) for v in values)
