"""Characteristic curve of a term along its axis, computed by the term's own code.

The motion of a plant is prescribed: its nodes are moved, its tape is pulled or its drives are commanded along the
term's axis, and the change by the term is recorded. The physics is not repeated here: the line of the term is that of
the generated plant, and the plant's own `start` fills the machine's record. The code is interpreted, since compiling
would take longer than the run.
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.idiom import Settings, interpreted
from rtctl.plants.graph import plant as graph
from rtctl.plants.graph.plant import GRAPH_STATE
from rtctl.plants.physics.place import PLANTS, place
from rtctl.plants.physics.placement import anywhere
from rtctl.plants.physics.term import SITES, Term

ROWS = 600
SAMPLE = 2e-3  # s
VOLTS, TENSION, STILL = 3.0, 1.5, 1.0  # V and N to either side; V that is held
MOTIONS = {  # by the term's axis
    "velocity": "speeds", "position": "to and fro", "angle": "turn", "command": "commands", "time": "wait",
    "frequency": "step", "tension": "pull",
}  # fmt: skip
SPAN = {  # range of a sweep, in units of the parameter that determines the shape
    "v_s": 4.0, "z_s": 6.0, "z_h": 4.0, "gap": 2.0, "offset": 3.0, "band": 3.0, "limit": 1.6, "wavelength": 1.25,
    "width": 4.0, "extra": 3.0, "tau": 5.0, "F_max": 2.0,
}  # fmt: skip
DRIVEN = ", driven"  # after a motion: under constant volts
CHANGES = "volts", "read", "pull", "dry", "force"  # in order of preference: the first that a term changes is its curve

TEXT = '''
import numpy as np
from rtctl.idiom import tick
from rtctl.plants import {kind}, linear
from rtctl.plants.graph import plant as graph
from rtctl.plants.physics import {module}

@tick
def run(acts, P, S, p, s, i, r, l, c, q, v, volts, read, pull, dry, force):
    """Move the nodes row by row; commands come in, and what the term leaves of everything goes out."""
    m = s.m
    nq = m.nq
    for k in range(q.shape[0]):
        for n in range(nq):
            m.x[n], m.x[nq + n] = q[k, n] - 0.5 * m.h * v[k, n], v[k, n]
            m.qm[n], m.vm[n], m.f[n], m.dry[n] = q[k, n], v[k, n], 0.0, m.dry_base[n]
        m.link_T[:], m.link_e[:], m.link_v[:] = 0.0, 0.0, 0.0
        m.volts[:] = volts[k]
        if acts:
            {command}
        m.u[:] = m.volts
        if acts:
            {force}
            {last}
        m.t += m.h
        for n in range(nq):
            m.r[n] = -np.sign(v[k, n]) * m.dry[n]
            m.x[n] = q[k, n] + 0.5 * m.h * v[k, n]
        for n in range(m.nl):
            pull[k, n] = linear.tension(m, n)
        graph.read(p.graph, m)
        if acts:
            {reading}
        volts[k], read[k], dry[k], force[k] = m.volts, m.y, m.dry[:nq], m.f[:nq]
'''


class Curve(NamedTuple):
    """A term's curve (n,), and the curve without the term (n,)."""

    x: np.ndarray
    y: np.ndarray
    without: np.ndarray
    x_words: str
    y_words: str
    settings: Settings
    kind: str  # of the plant


class Hand(NamedTuple):
    """Prescribed motion, row by row: the node's position and speed, the stretch of its link in m, the volts."""

    h: float
    x: np.ndarray
    v: np.ndarray
    stretch: np.ndarray
    volts: np.ndarray

    @property
    def t(self) -> np.ndarray:
        """Middle of each row, s."""
        return (np.arange(len(self.x)) + 0.5) * self.h


def portrait(term: Term) -> Curve:
    """The curve of a term at a typical size, at the first node of the plant that shows its axis best."""
    where = anywhere(term)
    order = sorted(sorted(PLANTS), key=lambda kind: term.axis not in PLANTS[kind].SHOWN.axes)
    kind = next(k for k in order if k in where)
    return curve(term, typical(term, kind, where[kind][0]), kind)


def typical(term: Term, kind: str, node: str) -> Settings:
    """Settings in the middle of their typical ranges."""
    of = PLANTS[kind].SHOWN.scales
    of = of | {
        "": 1.0, "dry": of["force"], "force/speed": of["force"] / of["speed"],
        "force/speed^2": of["force"] / of["speed"] ** 2, "sample period": SAMPLE,
        "force/travel": of["force"] / of["travel"], "largest command": VOLTS,
        "stiffness/stretch^2": 3.0 * of["stiffness"] / of["travel"] ** 2,
    }  # fmt: skip
    values = {
        name: float(f"{(low * high) ** 0.5 * of[term.scale.get(name, '')]:.2g}")
        for name, (low, high) in term.typical.items()
    }
    if "at" in term.settings.model_fields:  # not where the machine starts, since an error counts as 0 there
        values["at"] = 1.5 * values["width"] if "width" in values else 0.5
    return term.settings.model_validate({"term": term.name, "node": node, **values})


def curve(term: Term, settings: Any, kind: str) -> Curve:
    """Curve of a term under the prescribed motion of its axis."""
    if term.joint is not None and not term.act:
        return spring(term, settings, kind)
    driven = term.shown.endswith(DRIVEN)
    motion = term.shown.removesuffix(DRIVEN) or MOTIONS[term.axis]
    shown_by = PLANTS[kind].SHOWN
    hand = motions(motion, settings, shown_by.scales)
    hand = hand._replace(volts=hand.volts + STILL) if driven else hand
    spot = place(kind, settings.node)
    link = shown_by.links.get(settings.node, spot.link)
    run = assembled(term, kind)
    got, none = (measure(run, acts, term, settings, kind, hand, link) for acts in (True, False))
    way, push = ("m", "N") if spot.factor or settings.node.startswith("tape") else shown_by.units
    shown = next((name for name in CHANGES if np.abs(got[name] - none[name]).max() > 0.0), "force")
    sign = np.where(hand.v < 0.0, -1.0, 1.0)

    def seen(of: dict[str, np.ndarray]) -> np.ndarray:
        if shown == "pull":  # the capstan carries the difference of its two tapes
            both = settings.node == "capstan"
            return of["pull"][:, 1] - of["pull"][:, 0] if both else of["pull"][:, link]
        if shown == "dry" or term.name.startswith("friction."):
            return sign * of["dry"][:, spot.node] - of["force"][:, spot.node]
        return of[shown][:, spot.channel if shown in ("volts", "read") else spot.node]

    y, without = seen(got), seen(none)
    words = {
        "volts": "voltage at the motor, V",
        "read": f"reading, {way}",
        "pull": "force of the contact, N" if settings.node == "capstan" else "pull, N",
        "dry": f"friction, {push}",
    }
    y_words = f"friction, {push}" if term.name.startswith("friction.") else words.get(shown, f"force, {push}")
    if shown == "read" and not term.shown:
        y, without, y_words = y - without, 0.0 * y, f"error of the reading, {way}"
    x, x_words = {
        "speeds": (hand.v, f"speed, {way}/s"), "commands": (hand.volts, "command, V"), "wait": (hand.t, "time, s"),
        "step": (hand.t, "time, s"), "turn": (hand.x / (2 * np.pi), "turns"),
        "pull": (none["pull"][:, link], "pull of a linear tape, N"),
    }.get(motion, (hand.x, f"position, {way}"))  # fmt: skip
    return Curve(x, y, without, x_words, y_words, settings, kind)


def spring(term: Term, settings: Any, kind: str) -> Curve:
    """Pull of a joint that the term makes a spring, by its stretch; without the term the joint is rigid."""
    assert term.joint is not None
    shown_by = PLANTS[kind].SHOWN
    travel, (way, force) = shown_by.scales["travel"], shown_by.units
    x = np.linspace(-1e-3, 1e-3, ROWS) * travel
    y = term.joint(settings)["stiffness"] * x
    return Curve(x, y, 0.0 * x, f"stretch, {way}", f"pull, {force}", settings, kind)


def motions(motion: str, settings: Any, scales: dict[str, float]) -> Hand:
    """Position, speed, stretch and volts of a motion, over the range of the term's parameters."""
    z = (np.arange(ROWS) + 0.5) / ROWS
    still = np.zeros(ROWS)
    swing = np.interp(z, [0.0, 0.2, 0.6, 1.0], [0.0, 1.0, -1.0, 1.0])
    span = next((SPAN[n] * abs(getattr(settings, n)) for n in SPAN if hasattr(settings, n)), None)
    on = np.where(z > 0.1, 1.0, 0.0)
    if motion == "speeds":
        v = (2.0 * z - 1.0) * (span or scales["speed"])
        return Hand(SAMPLE, np.cumsum(v) * SAMPLE, v, still, still)
    if motion == "commands":
        return Hand(SAMPLE, still, still, still, (2.0 * z - 1.0) * (span or VOLTS))
    if motion == "wait":
        h = (span or 1.0) / ROWS
        return Hand(h, z * scales["travel"], still + scales["travel"] / (ROWS * h), still, still + STILL)
    if motion == "step":
        h = (8.0 / settings.f_Hz if hasattr(settings, "f_Hz") else span or 1.0) / ROWS
        up = 0.5 - 0.5 * np.cos(np.pi * np.clip((z - 0.1) / 0.04, 0.0, 1.0))
        x = 1e-4 * scales["travel"] * up
        return Hand(h, x, np.gradient(x, h), 1e-3 * up, on * STILL)
    if motion == "past":
        x = (2.0 * z - 1.0) * (span or scales["travel"])
        return Hand(SAMPLE, x, np.gradient(x, SAMPLE), still, still)
    if motion == "pull":
        most = span or TENSION
        return Hand(SAMPLE, still, still, np.interp(z, [0.0, 0.4, 1.0], [0.0, 1.0, -1.0]) * most / 450.0, still)
    if motion in ("turn", "taut"):
        many = 8.0 if hasattr(settings, "d") else 1.0 if hasattr(settings, "per_turn") else 2.0
        x = 2.0 * np.pi * many * z
        v = still + scales["speed"]
        return Hand(2.0 * np.pi * many / ROWS / scales["speed"], x, v, still + TENSION / 450.0, still)
    x = swing * (span or scales["travel"])
    return Hand(SAMPLE, x, np.gradient(x, SAMPLE), still, still)


def measure(run: Any, acts: bool, term: Term, settings: Any, kind: str, hand: Hand, link: int) -> dict[str, np.ndarray]:
    """Quantities of `CHANGES`, (n, number of each), under the prescribed motion, with or without the term."""
    p, s = stand(kind, hand.h)
    m, spot = s.m, place(kind, settings.node)
    r = getattr(p, spot.factor) if spot.factor else 1.0
    ratio = np.array(PLANTS[kind].SHOWN.ratios(p))
    ratio = ratio / (ratio[spot.node] * r)
    q, v = hand.x[:, None] * ratio, hand.v[:, None] * ratio
    if PLANTS[kind].SHOWN.stretches and hand.stretch.any():
        end, arm = m.link_i[link], m.link_a[link]
        q[:, end] += hand.stretch / arm
        v[:, end] += np.gradient(hand.stretch, hand.h) / arm
    n, nq = q.shape
    volts = np.repeat(hand.volts[:, None], len(m.u), axis=1)
    out = [volts, np.zeros((n, len(m.y))), np.zeros((n, len(m.link_T))), np.zeros((n, nq)), np.zeros((n, nq))]
    params = term.build(settings, hand.h)
    S = np.zeros(1, term.state if term.state is not None else [("spare", "f8")]).view(np.recarray)[0]
    with interpreted():  # a few hundred rows: compiling would take longer
        run(acts, params, S, p, s, spot.node, r, spot.link, spot.channel, q, v, *out)
    for torque in out[3:]:
        torque /= r
    return dict(zip(CHANGES, out, strict=True))


def assembled(term: Term, kind: str) -> Any:
    """The stand's run with the term's lines in it."""
    names = {"p": "P", "s": "S", "m": "m", "i": "i", "r": "r", "l": "l", "c": "c"}
    lines = {
        site: (term.act_at(site, kind) or "pass").format(**names).replace("\n", "\n" + 12 * " ")  # as deep as its site
        for site in SITES
    }
    module = term.build.__module__.rpartition(".")[2]
    scope: dict[str, Any] = {}
    exec(TEXT.format(kind=kind, module=module, **lines), scope)
    return scope["run"]


def stand(kind: str, h: float) -> tuple[Any, Any]:
    """Params and state of a machine at rest whose rows last `h` s."""
    plant = PLANTS[kind]
    name = kind.capitalize()
    p = plant.build(getattr(plant, f"{name}Settings")(parameters=plant.SHOWN.parameters), h, *plant.SHOWN.drives)
    s = np.zeros(1, GRAPH_STATE).view(np.recarray)[0]
    graph.prepare.interpret(p.graph, s.m)  # without the matrix exponential, which is not needed
    graph.assemble.interpret(p.graph, s.m)
    s.m.Gamma_T[:, :] = h * s.m.G.T
    return p, s
