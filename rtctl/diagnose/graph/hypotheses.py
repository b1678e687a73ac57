"""Hypotheses of a recording: each term of the library at each element of the machine where it can stand."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d

from rtctl.diagnose.graph.measures import Measures, lever, way
from rtctl.diagnose.graph.model import GraphModel
from rtctl.diagnose.graph.simulate import Simulator
from rtctl.diagnose.hints import MOST, ORDERS, jumps, peaks, seen, spectrum, spots
from rtctl.diagnose.hypotheses import parts_of, searched, shows_alone, starts_of
from rtctl.diagnose.space import Hypothesis
from rtctl.idiom import Settings
from rtctl.plants.graph.elements import contacts, undriven
from rtctl.plants.physics import TERMS, nodes, standing

QUICK = 2.0  # times the observer's bandwidth: a faster ripple is not in what it shows
WAVES = 24  # wavelengths tried between a tenth of the travel and twice the travel
SLIGHT = 0.01  # of the force that moves a node: dry friction that nothing else could be told by
ROWS = 8000  # of a spectrum
CALM = 5e-3  # s, over which an acceleration is taken
SLIPPING = (0.8, 0.92, 0.97, 0.99, 0.997)  # shares of the time that a contact may hold


def hypotheses(
    sim: Simulator, model: GraphModel, hints: dict[str, list] | None = None, beside: Sequence[Settings] = ()
) -> list[Hypothesis]:
    """All of them for this machine, one for each start."""
    there = sim.elements
    measures = Measures(sim, model.base, hints or {})
    known = set(sim.kernel.names)
    dry_too = {str(getattr(s, "node", "")) for s in beside if TERMS[str(getattr(s, "term", ""))].friction == "dry"}
    out: list[Hypothesis] = []
    for name, term in TERMS.items():
        if not (name in known or term.joint) or not searched(name):
            continue
        for node in nodes(term, there):
            found = standing(term, there, node)
            assert found is not None
            stand, element = found
            slides = "slides" in element.traits
            rubs = measures.dry(node) > SLIGHT * measures.of("force", node) or node in dry_too
            if (
                stand.again
                or not stand.offered
                or not term.in_format(sim.case.format)
                or ("contact" in element.traits and "contact" not in stand.needs)
                or ("turns" in element.traits and measures.scale(node).span < 2 * np.pi * term.needs.turns)
                or (term.needs.compared and len(sim.channels) < 2 and not shows_alone(term, element, slides, False))
                or ((term.falls_to or term.replaces or term.needs.dry) and not rubs)
            ):
                continue
            out += starts_of(name, node, (term.sliding if slides else ()) or parts_of(name), measures)  # type: ignore[arg-type]
    return out


def hints(sim: Simulator, model: GraphModel, begin: int) -> dict[str, list]:
    """Suggestions by kind (and node): order, wavelength, spot, and jump (time, size) of each sensor.

    Source: order tracking by least squares on cosine and sine of the angle; the correction of the observer as the
    missing force (Ohnishi, Shibata & Murakami 1996).
    """
    record = sim.record
    read, _ = sim.everything(model)
    _, push = faster(sim).everything(model)
    x, d = way(sim)[begin:], push[begin:]
    if not np.isfinite(d).all():
        d = np.zeros_like(d)
    thin = max(1, len(x) // ROWS)
    rate = uniform_filter1d(np.abs(np.gradient(x)) / record.dt, 51)[::thin]
    x, d = x[::thin], d[::thin]
    quick = QUICK * faster(sim).follow
    found: dict[str, list] = {}
    for node, ratio in sim.ratios.items():
        if ratio != 0.0 and sim.case.machine.turns(node):
            found[f"order:{node}"] = peaks(ORDERS, seen(x * ratio, d, rate * abs(ratio), ORDERS, quick), MOST)
        elif ratio != 0.0:
            span = float(np.ptp(x)) * abs(ratio) or 1.0
            waves = span * np.geomspace(0.02, 2.0, 2 * WAVES)
            found[f"wavelength:{node}"] = peaks(waves, spectrum(x * ratio, d, 2 * np.pi / waves), MOST)
            found[f"order:{node}"] = []
    for name in sim.channels:
        body = sim.case.machine.sensors[name].body
        if body is not None and not sim.case.machine.turns(body):
            found[f"wavelength:{name}"] = found.get(f"wavelength:{body}", [])
    found["spot"] = spots(x, d, MOST)
    found |= grips(sim, model)
    for name in sim.channels:
        grain = record.grain[name]
        if grain > 0.0 and sim.case.machine.sensors[name].measures == "position":
            error = (record.y[name] - read[:, sim.layout.sensors[name]]) / grain
            found[f"jump:{name}"] = [
                (float(record.t[k] - record.t[0]), size * grain) for k, size in jumps(error, 1.0)
            ]  # fmt: skip
    return found


def grips(sim: Simulator, model: GraphModel, shares: tuple[float, ...] = SLIPPING) -> dict[str, list]:
    """Limits that would hold each contact for these `shares` of the time, by what lies behind it on the rigid machine.

    The bodies behind a contact are those that no drive moves but through it.
    """
    record, machine, values = sim.record, sim.case.machine, model.base
    w = max(1, round(CALM / record.dt))
    x = way(sim)
    if len(x) <= 4 * w:
        return {}
    v = (x[2 * w :] - x[: -2 * w]) / (2 * w * record.dt)
    a = (x[2 * w :] - 2 * x[w:-w] + x[: -2 * w]) / (w * record.dt) ** 2
    found: dict[str, list] = {}
    for node, contact in contacts(machine).items():
        at = lever(sim.layout, values, node, True)
        assert at is not None
        moved = at[1] * sim.ratios[at[0]]
        force = np.zeros(len(v))
        for name in {node} if not contact.joint else undriven(machine, contact.joint):
            own, key = sim.ratios[name], "inertia" if machine.turns(name) else "mass"
            force += own**2 * (values[f"bodies.{name}.{key}"] * a + values.get(f"bodies.{name}.viscous", 0.0) * v)
            force += abs(own) * values.get(f"bodies.{name}.dry", 0.0) * np.sign(v)
        found[f"grip:{node}"] = [float(f) for f in np.quantile(np.abs(force / moved), shares)]
    return found


def faster(sim: Simulator) -> Simulator:
    """The observer that shows missing forces over a wider band."""
    other = sim.finer(1)
    other.follow = min(3.0 * sim.follow, 0.25 / sim.record.dt)
    return other
