"""Test bench for physics terms: a plant with any term at any node, driven open loop by the inputs of a test.

One compiled run per plant; the number of a slot selects its term.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from rtctl.idiom import Settings, fill_record, record_dtype
from rtctl.plants import axis, ivu, ldu
from rtctl.plants.graph import plant as graph
from rtctl.plants.graph.plant import GRAPH_STATE
from rtctl.plants.physics import (
    contact,
    friction,
    friction_direction,
    friction_load,
    load,
    presliding,
    structure,
    tape,
    transmission,
)
from rtctl.plants.physics.place import place
from rtctl.plants.physics.placement import nodes
from rtctl.plants.physics.term import Term

MODULES = (
    contact,
    friction,
    friction_direction,
    friction_load,
    load,
    presliding,
    structure,
    tape,
    transmission,
)
TERMS: dict[str, Term] = {
    term.name: term for module in MODULES for term in vars(module).values() if isinstance(term, Term)
}
PLANTS: dict[str, Any] = {"axis": axis, "ivu": ivu, "ldu": ldu}
SLOTS = 3
COUNT = {"axis": (1e-6,), "ivu": (2 * np.pi / 10_000,) * 3, "ldu": (2 * np.pi / 20_000, 0.5e-6)}  # of each sensor

TEXT = '''
import numpy as np
from rtctl.idiom import tick
from rtctl.plants import {kind}, linear
from rtctl.plants.graph import plant as graph
from rtctl.plants.physics import {modules}

@tick
def force(number, p, s, m, i, r, l, c):
    {force}

@tick
def reading(number, p, s, m, i, r, l, c):
    {reading}

@tick
def run(slots, ps, ss, p, s, inputs, substeps, q, v, y, work):
    """Hold each row of inputs for some substeps; positions, speeds, readings and work of the terms, row by row."""
    m = s.m
    nq = m.nq
    done = 0.0
    for k in range(inputs.shape[0]):
        for d in range(m.nu):
            m.u[d] = inputs[k, d]
        for _ in range(substeps):
            linear.midpoint(m)
            for n in range(slots.shape[0]):
                force(slots[n].number, ps[n], ss[n], m, slots[n].i, slots[n].r, slots[n].l, slots[n].c)
            for i in range(nq):
                m.qm[i] = m.x[i]
            linear.advance(m)
            for i in range(nq):
                done += (m.f[i] + m.r[i]) * (m.x[i] - m.qm[i])
        graph.read(p.graph, m)
        for n in range(slots.shape[0]):
            reading(slots[n].number, ps[n], ss[n], m, slots[n].i, slots[n].r, slots[n].l, slots[n].c)
        for i in range(nq):
            q[k, i], v[k, i] = m.x[i], m.x[nq + i]
        for i in range(m.ny):
            y[k, i] = m.y[i]
        work[k] = done
'''
SLOT = np.dtype([("number", "i8"), ("i", "i8"), ("l", "i8"), ("c", "i8"), ("r", "f8")])


class Run(NamedTuple):
    """Rows of positions (n, nq), speeds, readings (n, ny) and work of terms and dry friction (n,), and the machine."""

    q: np.ndarray
    v: np.ndarray
    y: np.ndarray
    work: np.ndarray
    s: Any
    states: Any


@cache
def compiled(kind: str) -> tuple[Any, np.dtype, np.dtype]:
    """Run function, and records of params and state of a slot."""
    terms = [term for term in TERMS.values() if nodes(term, kind)]
    names = {"p": "p.{}", "s": "s.{}", "m": "m", "i": "i", "r": "r", "l": "l", "c": "c"}
    sites = {}
    for site in ("force", "reading"):
        lines = ["pass"]
        for number, term in enumerate(terms, 1):
            line = term.act_at(site, kind)
            if line is not None:
                field = term.name.replace(".", "_")
                filled = line.format(**{k: name.format(field) for k, name in names.items()})
                lines += [f"if number == {number}:", *(f"    {part}" for part in filled.split("\n"))]
        sites[site] = "\n    ".join(lines)
    scope: dict[str, Any] = {}
    modules = ", ".join(sorted({term.build.__module__.rpartition(".")[2] for term in terms}))
    exec(TEXT.format(kind=kind, modules=modules, **sites), scope)
    params, states = [], [("spare", np.float64)]
    for term in terms:
        field = term.name.replace(".", "_")
        params.append((field, record_dtype(term.build(usual(term.name, kind), 1e-3))))
        if term.state is not None:
            states.append((field, term.state))
    return scope["run"], np.dtype(params, align=True), np.dtype(states, align=True)


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
    inputs: np.ndarray,
    *,
    tick: float = 1e-3,
    substeps: int | None = None,
    speeds: dict[str, float] | None = None,
    **parameters: float,
) -> Run:
    """Drive a machine at rest (or with speeds at its nodes) by inputs (n, nu), each held for `tick` s."""
    function, params, states = compiled(kind)
    substeps = substeps or SUBSTEPS[kind]
    p, s = plant(kind, tick / substeps, **parameters)
    nq, known = s.m.nq, [term for term in TERMS.values() if nodes(term, kind)]
    for node, speed in (speeds or {}).items():
        spot = place(kind, node)
        s.m.x[nq + spot.node] = s.m.v_before[spot.node] = speed / (getattr(p, spot.factor) if spot.factor else 1.0)
    slots = np.zeros(SLOTS, SLOT).view(np.recarray)
    ps, ss = np.zeros(SLOTS, params).view(np.recarray), np.zeros(SLOTS, states).view(np.recarray)
    for n, settings in enumerate(terms):
        term = TERMS[settings.term]  # type: ignore[attr-defined]
        spot = place(kind, settings.node)  # type: ignore[attr-defined]
        factor = getattr(p, spot.factor) if spot.factor else 1.0
        slots[n] = (known.index(term) + 1, spot.node, spot.link, spot.channel, factor)
        fill_record(ps[n][term.name.replace(".", "_")], term.build(settings, tick / substeps))
    inputs = np.ascontiguousarray(np.asarray(inputs, float).reshape(len(inputs), -1))
    n = len(inputs)
    out = np.zeros((n, nq)), np.zeros((n, nq)), np.zeros((n, s.m.ny)), np.zeros(n)
    function(slots, ps, ss, p, s, inputs, substeps, *out)
    return Run(*out, s, ss)


def kinetic(s: Any, v: np.ndarray) -> np.ndarray:
    """Kinetic energy of rows of speeds (n, nq), J."""
    nq, nu = s.m.nq, s.m.nu
    inertia = np.array([1.0 / s.m.G[nq + i, nu + i] for i in range(nq)])
    return 0.5 * (v**2 * inertia).sum(axis=1)


def first(kind: str, term: str) -> str:
    """First node of a term on a plant."""
    return nodes(TERMS[term], kind)[0]


FORCE = {  # force or torque that moves each node, near its dry friction
    "axis": {"carriage": 20.4},
    "ivu": {"motor1": 2.5e-3, "motor2": 2.5e-3, "reel1": 2.5e-3, "reel2": 2.5e-3, "capstan": 1e-3},
    "ldu": {"motor": 6e-4, "wheel": 0.02, "capstan": 0.022, "carriage": 7.3},
}
SPEED = {"axis": {}, "ivu": {}, "ldu": {"motor": 200.0, "wheel": 10.0, "capstan": 10.0}}
SPEED_OF = {"axis": 0.05, "ivu": 2.0, "ldu": 0.03}  # of the nodes not named
TRAVEL = {"axis": {}, "ivu": {}, "ldu": {"motor": 40.0, "wheel": 2.0, "capstan": 2.0}}
TRAVEL_OF = {"axis": 0.02, "ivu": 0.3, "ldu": 6e-3}
INERTIA = {
    "axis": {"carriage": 95.0},
    "ivu": {"motor1": 1.5e-3, "motor2": 1.5e-3, "reel1": 1e-4, "reel2": 4e-5, "capstan": 5e-6},
    "ldu": {"motor": 1e-6, "wheel": 1e-5, "capstan": 1.1e-5, "carriage": 1.25},
}


def usual(term: str, kind: str, node: str | None = None, **changes: Any) -> Settings:
    """A term of typical size for the machine."""
    node = node or first(kind, term)
    F, J = FORCE[kind].get(node, 0.0), INERTIA[kind].get(node, 0.0)
    V, X = SPEED[kind].get(node, SPEED_OF[kind]), TRAVEL[kind].get(node, TRAVEL_OF[kind])
    wheel = node == "wheel"
    values: dict[str, dict[str, Any]] = {
        "friction.coulomb": {"F_C": 0.3 * F},
        "friction.viscous": {"B": 0.2 * F / V},
        "friction.quadratic": {"Q": 0.3 * F / V**2},
        "friction.stribeck": {"F_s": 1.3 * F, "v_s": 0.2 * V},
        "friction.asymmetry": {"a": 0.2, "B_a": 0.05 * F / V},
        "friction.load": {"mu": 0.1},
        "friction.presliding": {"z_s": 0.02 * X},
        "transmission.backlash": {"gap": {"axis": 2e-5, "ivu": 0.01, "ldu": 2e-3 if node == "capstan" else 0.03}[kind]},
        "transmission.slip": {"F_max": 0.01 if kind == "ivu" else 1.2e-3 if wheel else 7.0},
        "transmission.creep": {"kappa": 0.3 if kind == "ivu" else 1.0 if wheel else 1e-3},
        "structure.resonance": {"f_Hz": 60.0, "mass": 0.6 * J},
        "structure.stiffening": {
            "c3": F / X**3
            if kind == "axis"
            else (1e7 if wheel else 1e6)
            if kind == "ldu"
            else 1e8
            if "tape" in node
            else 3e8
        },
        "tape.viscoelastic": {"c_branch": 450.0, "tau": 0.1},
        "tape.slack": {},
        "load.spring": {"k": 0.5 * F / X},
        "load.cable_chain": {"k": 0.3 * F / X, "F_h": 0.2 * F, "z_h": 0.05 * X},
        "load.imbalance": {"A": 0.2 * F, "phi": np.pi},
        "load.bump": {"F": 0.5 * F, "at": 0.2 * X, "width": 0.05 * X},
    }
    return TERMS[term].settings(node=node, **{**values[term], **changes})


NOTHING: dict[str, dict[str, float]] = {  # parameters for zero effect
    "friction.coulomb": {"F_C": 0.0},
    "friction.viscous": {"B": 0.0},
    "friction.asymmetry": {"a": 0.0, "B_a": 0.0},
    "friction.load": {"mu": 0.0},
    "friction.presliding": {"z_s": 0.0},
    "transmission.backlash": {"gap": 0.0},
    "transmission.slip": {"F_max": 1e6},
    "transmission.creep": {"kappa": 0.0},
    "structure.resonance": {"mass": 0.0},
    "friction.quadratic": {"Q": 0.0},
    "structure.stiffening": {"c3": 0.0},
    "tape.viscoelastic": {"c_branch": 0.0},
    "tape.slack": {"share": 0.0},
    "load.spring": {"k": 0.0},
    "load.cable_chain": {"k": 0.0, "F_h": 0.0},
    "load.imbalance": {"A": 0.0},
    "load.bump": {"F": 0.0},
}
DRY = {("axis", "carriage"): 20.4, ("ivu", "motor1"): 2.4e-3, ("ivu", "motor2"): 2.6e-3, ("ivu", "capstan"): 1e-4,
       ("ldu", "carriage"): 7.3, ("ldu", "capstan"): 7.3 * 3e-3}  # fmt: skip


def nothing(term: str, kind: str, node: str | None = None) -> Settings:
    """The term with zero effect."""
    node = node or first(kind, term)
    if term == "friction.stribeck":
        return usual(term, kind, node, F_s=DRY.get((kind, node), 0.0))
    return usual(term, kind, node, **NOTHING[term])


def moves(kind: str, seconds: float = 2.0, tick: float = 1e-3, loose: bool = False) -> np.ndarray:
    """Inputs (n, nu) for a reciprocating motion, with a taut tape or, with `loose`, a tape that goes slack."""
    t = np.arange(round(seconds / tick)) * tick
    there = np.sign(np.sin(4 * np.pi * t) + 0.3)
    if kind == "ivu":
        hold, swing = (0.1, 0.6) if loose else (0.6, 0.45)
        return np.stack([hold + swing * there, hold - swing * there], axis=1)
    return {"axis": 2.0, "ldu": 0.12}[kind] * there * (1 - 0.3 * np.cos(1.4 * np.pi * t))


SUBSTEPS = {"axis": 2, "ivu": 4, "ldu": 20}  # per millisecond, as in the emulators
