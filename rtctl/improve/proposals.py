"""Remedies proposed for a machine: by its description, by the declaration of each effect's term, and without a name."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rtctl import machines
from rtctl.config.load import written as plain
from rtctl.design.feedforward import INERTIA
from rtctl.improve import curve, sensor_table
from rtctl.improve.found import Effect
from rtctl.improve.ground import Ground
from rtctl.improve.margins import delay
from rtctl.improve.remedy import BASE, Remedy
from rtctl.improve.unnamed import unnamed
from rtctl.laws import predictor
from rtctl.machines.profiles import profile_of

BELOW = 0.9  # share of dry friction that is compensated: above it the machine may creep without a command
SHARES = (0.9, 1.0, 0.75, 0.5)  # of any other effect
SLOWER = (0.8, 0.6)  # bandwidth of the reference
TIGHTER = (2.0, 1.5, 3.0, 0.7)  # tension of the tape
FILTERED = 3.0  # crossovers at which the speed of a predictor is filtered
LESS = (1.0, 0.8, 0.6, 0.45, 0.3)  # factors of the gains, tried where the margins are too small
GAINS = ("gain", "velocity_gain")  # of a position law: the loop gain is in proportion to them
LEAST = (6.0, 45.0)  # dB and degrees
WHOLE = ("curve", "table", "joint")  # remedies that hold all effects of their kind at once
FEED = f"{BASE}.feedforward"


def proposals(g: Ground) -> list[Remedy]:
    """Every remedy in the order in which it is tried."""
    out = margins_first(g) + (description(g) if g.gain else [])
    kinds = sorted(MAKERS, key=list(MAKERS).index)
    for kind in kinds:
        for effect in g.found.effects:
            if kind in effect.term.remedies and (made := MAKERS[kind](g, effect)) is not None:
                out.append(made)
    merged: dict[tuple[str, str], Remedy] = {}
    for remedy in (*out, *unnamed(g)):
        merged.setdefault((remedy.kind, "" if remedy.kind in WHOLE else remedy.against), remedy)
    return list(merged.values())


def margins_first(g: Ground) -> list[Remedy]:
    """Notch at the frequency of the gain margin, or lower gains, for a loop with less than the least margins."""
    found, law = g.margins, g.found.config.law.position
    if found is None or (found.GM >= LEAST[0] and found.PM >= LEAST[1]):
        return []
    gains = {name: getattr(law, name) for name in GAINS if getattr(law, name, None)}
    rate = g.found.config.loop.rate
    notches: list[dict[str, Any]] = [{}]
    if np.isfinite(found.f_GM) and found.f_GM < 0.4 * rate:
        notches = [
            {f"{BASE}.filter.sections": [notch_at(found.f_GM * shift, depth, width)]}
            for depth, width in ((0.2, 0.4), (0.1, 0.5), (0.1, 0.8))
            for shift in (1.0, 1.07)
        ]
    ways = [
        {**notch, **{f"law.position.{name}": float(f"{share * value:.4g}") for name, value in gains.items()}}
        for share in LESS
        for notch in (*notches, {})
    ]
    size = f"the loop has {found.GM:.1f} dB and {found.PM:.0f} degrees"
    ways = [way for way in ways if way]
    return [Remedy("margins", "notch and gains for the margins", "the loop's margins", size, tuple(ways))]


def notch_at(hertz: float, depth: float, width: float) -> dict[str, Any]:
    """Settings of a notch at `hertz` with the gain `depth` at its frequency."""
    return {
        "kind": "notch", "frequency": float(f"{hertz:.4g}"), "zeta_z": float(f"{depth * width:.4g}"), "zeta_p": width,
    }  # fmt: skip


def description(g: Ground) -> list[Remedy]:
    """Feedforward by the description: inertia, friction, weight, and the command of the velocity feedback."""
    config = g.found.config
    machine = machines.build(config)
    lead = machine.dt * (0.5 + (config.loop.write == "next_tick"))
    values = {f"{FEED}.lead": lead, f"{FEED}.velocity": 1.0, f"{FEED}.viscous": 1.0, f"{FEED}.friction": BELOW}
    inertia = {f"{FEED}.inertia": 1.0} if config.law.shaper.bandwidth is not None else {}
    own = profile_of(config.kind).feedforward
    ways = [{**values, **inertia, **dict.fromkeys(own, 0.0)}]
    if own:  # in addition to the machine's own feedforward, or instead of its friction compensation
        rest = {f"{FEED}.inertia": 1.0 - INERTIA} if inertia else {}
        friction = dict.fromkeys((key for key in own if not key.startswith("law.inertia")), 0.0)
        ways += [{**values, **rest, f"{FEED}.friction": 0.0}, {**values, **rest, **friction}]
    size = f"inertia, weight, viscous friction and {BELOW:g} of the dry friction of the description"
    return [Remedy("description", "feedforward of the description", "the motion itself", size, tuple(ways))]


def feedforward(g: Ground, effect: Effect) -> Remedy | None:
    """The effect's own law along the reference."""
    if not g.gain:
        return None
    path = f"{FEED}.effects.{effect.number}.share"
    shares = (BELOW, 0.7) if any("{m}.dry" in line for line in effect.term.act.values()) else SHARES
    ways = tuple({path: share} for share in shares)
    note = "" if effect.term.axis not in ("position", "angle") else PLACE
    return Remedy("feedforward", "feedforward of its own law", effect.words, effect.interval, ways, note)


def static_curve(g: Ground, effect: Effect) -> Remedy | None:
    """Inverse of the curve of all static effects of the drive."""
    points = curve.inverse(g.found)
    if points is None:
        return None
    return Remedy(
        "curve", "inverse of the drive's curve", effect.words, effect.interval, ({f"{BASE}.inverse.points": points},)
    )


def joint(g: Ground, effect: Effect) -> Remedy | None:
    """Reference through the joint."""
    if not g.gain or not hasattr(g.found.config.machine, "bodies"):
        return None
    ways = ({f"{FEED}.through": g.judge.words},)
    return Remedy("joint", f"reference of {g.judge.words} through the joint", effect.words, effect.interval, ways)


def ahead(g: Ground, effect: Effect) -> Remedy | None:
    """Reference taken ahead by the delay of the command."""
    extra = delay(effect.entry, "command", g.found.config)
    if not g.gain or extra <= 0.0:
        return None
    base = machines.build(g.found.config).dt * (0.5 + (g.found.config.loop.write == "next_tick"))
    return Remedy(
        "lead", "reference ahead by the delay", effect.words, effect.interval, ({f"{FEED}.lead": base + extra},)
    )


def behind(g: Ground, effect: Effect) -> Remedy | None:
    """Reference delayed by the lag of the sensor."""
    late = delay(effect.entry, "reading", g.found.config)
    if not g.gain or late <= 0.0:
        return None
    return Remedy(
        "behind", "reference of the time that the sensor shows", effect.words, effect.interval,
        ({f"{FEED}.behind": late},),
    )  # fmt: skip


def predicted(g: Ground, effect: Effect) -> Remedy | None:
    """Law closed on the position after the delay."""
    late, dt = delay(effect.entry, "command", g.found.config), machines.build(g.found.config).dt
    ticks = round(late / dt) + (g.found.config.loop.write == "next_tick")
    if not g.gain or late <= 0.0 or not 1 <= ticks <= predictor.MOST:
        return None
    made = {f"{BASE}.predictor": {"delay": ticks, "acceleration": float(f"{abs(g.gain[0]):.5g}")}}
    crossover = g.margins.f_PM if g.margins is not None else 0.01 * g.found.config.loop.rate
    ways = ({**made, "law.velocity.filter": float(f"{FILTERED * crossover:.3g}")}, made)
    return Remedy("delay", f"predictor over {ticks} ticks", effect.words, effect.interval, ways)


def table(g: Ground, effect: Effect) -> Remedy | None:
    """Table of the sensor's error."""
    made = sensor_table.of(g.found, g.travel)
    if made is None:
        return None
    values, anchored = made
    note = "" if anchored else ANCHOR
    return Remedy(
        "table", "table of the sensor's error", effect.words, effect.interval, ({f"{BASE}.correction": values},), note
    )


def limits(g: Ground, effect: Effect) -> Remedy | None:
    """Slower reference."""
    bandwidth = g.found.config.law.shaper.bandwidth
    if bandwidth is None:
        return None
    ways = tuple({"law.shaper.bandwidth": float(f"{share * bandwidth:.3g}")} for share in SLOWER)
    return Remedy("limits", "slower reference", effect.words, effect.interval, ways)


def tension(g: Ground, effect: Effect) -> Remedy | None:
    """Another tension of the tape, for a machine that sets one."""
    own = getattr(g.found.config.law, "tension", None)
    if own is None or own.F_t <= 0.0:
        return None
    ways = tuple({"law.tension.F_t": float(f"{share * own.F_t:.3g}")} for share in TIGHTER)
    return Remedy("tension", "another tension of the tape", effect.words, effect.interval, ways)


def notch(g: Ground, effect: Effect) -> Remedy | None:
    """Notch where the effect's motion rings."""
    hertz = getattr(effect.entry, "f_Hz", None)
    if not isinstance(hertz, float) or not 0.0 < hertz < 0.45 * g.found.config.loop.rate:
        return None
    ways = tuple(
        {f"{BASE}.filter.sections": [notch_at(hertz, depth, width)]} for depth, width in ((0.1, 0.5), (0.1, 0.3))
    )
    return Remedy("notch", f"notch at {hertz:.3g} Hz", effect.words, effect.interval, ways)


def data_of(config: Any) -> list[dict[str, Any]]:
    """Entries of `plant.physics` as plain data."""
    return [dict(entry) for entry in plain(config).get("plant", {}).get("physics", [])]


MAKERS: dict[str, Callable[[Ground, Effect], Remedy | None]] = {
    "feedforward": feedforward,
    "curve": static_curve,
    "joint": joint,
    "lead": ahead,
    "behind": behind,
    "delay": predicted,
    "table": table,
    "notch": notch,
    "tension": tension,
    "limits": limits,
}
PLACE = "counts from where the counter is 0: start from the same place, or from an index mark"
ANCHOR = (
    "the sensor has no absolute zero: without an index mark the table has to be made anew at every start, and a table "
    "of a wrong phase makes the error larger"
)
