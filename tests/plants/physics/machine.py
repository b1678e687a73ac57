"""A described machine with physics terms at its nodes, driven open loop, uncompiled."""

import importlib
from typing import Any, NamedTuple

import numpy as np

from rtctl.idiom import interpreted
from rtctl.plants import linear
from rtctl.plants.graph import params
from rtctl.plants.graph import plant as graph
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.elements import elements, spot
from rtctl.plants.graph.joints import sprung
from rtctl.plants.graph.layout import layout
from rtctl.plants.graph.plant import GRAPH_STATE
from rtctl.plants.physics import TERMS, ordered
from rtctl.plants.physics.term import SITES

H = 1e-3
SCREW = {  # motor - coupling - screw - rigid nut - table
    "bodies": {"motor": {"inertia": 2e-4}, "screw": {"inertia": 1e-4}, "table": {"mass": 20.0}},
    "joints": {
        "coupling": {"from": "motor", "to": "screw", "ratio": 1.0, "stiffness": 40.0, "damping": 0.02},
        "nut": {"from": "screw", "to": "table", "ratio": 1.6e-3},
    },
    "drives": {"amplifier": {"body": "motor", "column": "u", "kind": "force", "gain": 0.1}},
    "sensors": {
        "encoder": {"body": "motor", "measures": "position", "column": "counts", "counts_per_unit": 1000.0},
        "scale": {"body": "table", "measures": "position", "column": "scale", "counts_per_unit": 1e6},
    },
}  # fmt: skip
TEXT = """
def run(P, S, p, s, u, out):
    m = s.m
    for k in range(len(u)):
        m.volts[: u.shape[1]] = u[k]
        {command}
        graph.take(p, m)
        linear.midpoint(m)
        graph.weigh(p, m)
        {force}
        {last}
        linear.advance(m)
        graph.read(p, m)
        {reading}
        out[k] = *m.y[: p.ny], *m.x[: p.nq], *m.dry[: p.nq], *m.u[: p.nu]
"""


class Run(NamedTuple):
    """Rows (n, each) after each substep, and the machine."""

    y: np.ndarray
    x: np.ndarray
    dry: np.ndarray
    u: np.ndarray
    m: Any


def settings(term: str, node: str, **values: Any) -> Any:
    """An entry of a `physics:` list."""
    return TERMS[term].settings.model_validate({"term": term, "node": node, **values})


def run(machine: dict, terms: list, u: np.ndarray, h: float = H) -> Run:
    """Run with commands u (n, drives), each for a substep of `h` s."""
    there, _ = sprung(Description.model_validate(machine), terms)
    place, values = layout(there), dict(there.paths())
    p = params.build(place, values, h)
    s = np.zeros(1, GRAPH_STATE).view(np.recarray)[0]
    lines: dict[str, list[str]] = {site: ["pass"] for site in SITES}
    scope: dict[str, Any] = {"linear": linear, "graph": graph}
    P, S = [], []
    for entry in ordered(terms):
        term = TERMS[entry.term]
        at = spot(term, entry, place, elements(place), values)
        module = importlib.import_module(term.build.__module__)
        scope[module.__name__.rpartition(".")[2]] = module
        for site in SITES:
            line = term.act.get(site, "").format(
                p=f"P[{len(P)}]", s=f"S[{len(P)}]", m="m", i=at.node, r=at.factor, l=at.link, c=at.channel
            )
            lines[site] += line.split("\n") if line else []
        P.append(term.build(entry, h))
        S.append(np.zeros(1, term.state if term.state is not None else [("spare", "f8")]).view(np.recarray)[0])
    exec(TEXT.format(**{site: ("\n" + 8 * " ").join(found) for site, found in lines.items()}), scope)
    out = np.zeros((len(u), p.ny + 2 * p.nq + p.nu))
    with interpreted():
        graph.start(p, s)
        scope["run"](P, S, p, s, u.reshape(len(u), -1), out)
    return Run(*np.split(out, np.cumsum([p.ny, p.nq, p.nq]), axis=1), s.m)
