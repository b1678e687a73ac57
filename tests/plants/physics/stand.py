"""Test stand for terms at commands, readings and wheels: a plant with any such term, driven open loop by volts.

One compiled run per plant; the number of a slot selects its term.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from rtctl.idiom import Settings, fill_record, record_dtype, state
from rtctl.plants import axis, ivu, ldu
from rtctl.plants.graph import plant as graph
from rtctl.plants.graph.plant import GRAPH_STATE
from rtctl.plants.physics import (
    drive,
    drive_dynamics,
    geometry,
    guide,
    nodes,
    ordered,
    ripple,
    ripple_tape,
    sensor,
    timing,
)
from rtctl.plants.physics.place import place
from rtctl.plants.physics.term import SITES, Term

MODULES = (drive, drive_dynamics, geometry, guide, ripple, ripple_tape, sensor, timing)
TERMS: dict[str, Term] = {
    term.name: term for module in MODULES for term in vars(module).values() if isinstance(term, Term)
}
PLANTS: dict[str, Any] = {"axis": axis, "ivu": ivu, "ldu": ldu}
COUNT = {"axis": (1e-6,), "ivu": (2 * np.pi / 10_000,) + (2 * np.pi / 209,) * 2, "ldu": (2 * np.pi / 20_000, 0.5e-6)}
SLOTS = 2
REQUIRED = {
    "drive.offset": {"offset": 0.0},
    "drive.deadband": {"band": 0.0},
    "drive.gain_asymmetry": {"a": 0.0},
    "drive.saturation": {"limit": 1e3},
    "drive.supply_sag": {"k": 0.0},
    "drive.lag": {"tau": 0.0},
    "drive.thermal": {"a": 0.0},
    "timing.delay": {"extra": 0.0},
    "timing.jitter": {"sigma": 0.0},
    "ripple.cogging": {"A": 0.0},
    "ripple.encoder": {"A": 0.0},
    "ripple.reel": {"e": 0.0},
    "ripple.capstan": {"a": 0.0},
    "guide.thickness": {"A": 0.0},
    "guide.strip": {"longer": 0.0},
    "guide.dirt": {"A": 0.0, "at": 0.1},
    "sensor.missed_counts": {},
    "sensor.rectified": {"share": 0.0},
    "sensor.scale": {"relative": 0.0},
    "geometry.radius_change": {"d": 0.0},
}  # parameters for zero effect

TEXT = '''
from rtctl.idiom import tick
from rtctl.plants import {kind}, linear
from rtctl.plants.graph import plant as graph
from rtctl.plants.physics import {modules}

{sites}

@tick
def run(q, z, p, s, volts, substeps, x, y):
    """Hold each row of volts for some substeps; states and readings after each row."""
    m = s.m
    for k in range(volts.shape[0]):
        for _ in range(substeps):
            for c in range(m.nu):
                m.volts[c] = volts[k, c]
            command(q, z, m)
            for c in range(m.nu):
                m.u[c] = m.volts[c]
            linear.midpoint(m)
            force(q, z, m)
            last(q, z, m)
            linear.advance(m)
        graph.read(p.graph, m)
        reading(q, z, m)
        for i in range(m.nx):
            x[k, i] = m.x[i]
        for i in range(m.ny):
            y[k, i] = m.y[i]
'''
SITE = '''
@tick
def {site}(q, z, m):
    """Every term that acts at the {site}."""
    for k in range(q.shape[0]):
        {lines}
'''


class Run(NamedTuple):
    """States (n, nx) and readings (n, ny) after each row, and the machine."""

    x: np.ndarray
    y: np.ndarray
    s: Any


def terms_of(kind: str) -> list[Term]:
    """Terms that have a node on a plant."""
    return [term for term in TERMS.values() if nodes(term, kind)]


def source(kind: str) -> str:
    """The module's text: every term at every site."""
    sites = []
    for site in SITES:
        lines = ["pass"]
        for number, term in enumerate(terms_of(kind), 1):
            line, field = term.act_at(site, kind), term.name.replace(".", "_")
            if line is not None:
                filled = line.format(
                    p=f"q[k].{field}", s=f"z[k].{field}", m="m", i="q[k].i", r="q[k].r", l="q[k].l", c="q[k].c"
                )
                lines += [f"if q[k].number == {number}:", f"    {filled}"]
        sites.append(SITE.format(site=site, lines="\n        ".join(lines)))
    modules = ", ".join(module.__name__.rpartition(".")[2] for module in MODULES)
    return TEXT.format(kind=kind, modules=modules, sites="\n".join(sites))


@cache
def compiled(kind: str) -> tuple[Any, np.dtype, np.dtype]:
    """Run function, and the records of a slot and of its state."""
    scope: dict[str, Any] = {}
    exec(source(kind), scope)
    slot: dict[str, Any] = {"number": int, "i": int, "l": int, "c": int, "r": float}
    memory: dict[str, Any] = {"spare": float}
    for term in terms_of(kind):
        field = term.name.replace(".", "_")
        slot[field] = record_dtype(term.build(make(term.name, kind), 1e-3))
        if term.state is not None:
            memory[field] = term.state
    return scope["run"], state(**slot), state(**memory)


def make(name: str, kind: str, node: str | None = None, **values: Any) -> Any:
    """Settings of a term at a node, by default at its first node; parameters not given have zero effect."""
    term = TERMS[name]
    return term.settings(node=node or nodes(term, kind)[0], **{**REQUIRED[name], **values})


def plant(kind: str, h: float, **parameters: float) -> tuple[Any, Any]:
    """Params and state of a machine at rest, for substeps of `h` s."""
    module = PLANTS[kind]
    settings = getattr(module, f"{kind.capitalize()}Settings")(parameters=parameters)
    drives = {"axis": (), "ivu": ([(0.2, 2e3, 0.7, 0.0)] * 2,), "ldu": ((6e3, 0.7),)}[kind]
    p = module.build(settings, h, *drives)
    s = np.zeros(1, GRAPH_STATE).view(np.recarray)[0]
    graph.start(p.graph, s)
    return p, s


def run(
    kind: str,
    terms: list[Settings],
    volts: np.ndarray,
    *,
    tick: float = 2e-3,
    substeps: int = 4,
    x: dict[int, float] | None = None,
    **parameters: float,
) -> Run:
    """Drive a machine by volts (n, nu), each row held for `tick` s; `x` gives nonzero initial states."""
    function, slot, memory = compiled(kind)
    p, s = plant(kind, tick / substeps, **parameters)
    nq = s.m.nq
    for i, value in (x or {}).items():
        s.m.x[i] = value
        if nq <= i < 2 * nq:
            s.m.v_before[i - nq] = value
    q, z = np.zeros(SLOTS, slot).view(np.recarray), np.zeros(SLOTS, memory).view(np.recarray)
    names = [term.name for term in terms_of(kind)]
    for n, settings in enumerate(ordered(terms)):
        name, spot = settings.term, place(kind, settings.node)  # type: ignore[attr-defined]
        q[n].number, q[n].i, q[n].l, q[n].c = names.index(name) + 1, spot.node, spot.link, spot.channel
        q[n].r = getattr(p, spot.factor) if spot.factor else 1.0
        fill_record(q[n][name.replace(".", "_")], TERMS[name].build(settings, tick / substeps))
    volts = np.ascontiguousarray(np.asarray(volts, float).reshape(len(volts), -1))
    out = np.zeros((len(volts), s.m.nx)), np.zeros((len(volts), s.m.ny))
    function(q, z, p, s, volts, substeps, *out)
    return Run(*out, s)


def excitation(kind: str, n: int = 1500, tick: float = 2e-3) -> np.ndarray:
    """Volts (n, nu) for a reciprocating motion: sums of sines, of both signs, with a taut tape."""
    t = np.arange(n) * tick
    wave = np.sin(2 * np.pi * 0.7 * t) + 0.6 * np.sin(2 * np.pi * 3.1 * t)
    if kind == "ivu":
        return np.stack([0.6 + 0.5 * wave, 0.6 - 0.5 * wave], axis=1)
    return ((2.0 if kind == "axis" else 0.2) * wave)[:, None]  # the stand drives the LDU by amperes


def counts(kind: str, y: np.ndarray) -> np.ndarray:
    """Readings (n, ny) in counts."""
    return np.floor(y / np.array(COUNT[kind]))


def seen(kind: str, terms: list[Settings], **options: Any) -> float:
    """Largest change of any channel by the terms, in counts."""
    volts = excitation(kind)
    one, two = run(kind, [], volts, **options), run(kind, terms, volts, **options)
    return float(np.abs(counts(kind, two.y) - counts(kind, one.y)).max())
