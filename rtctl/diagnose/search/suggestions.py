"""Hints of a recording for starts: orders, wavelengths, places, limits and jumps, by node.

Source: order tracking by least squares on cosine and sine of the angle; the correction of the observer as the missing
force (Ohnishi, Shibata & Murakami 1996).
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.node_scaling import lever, way
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.search.disturbance_estimate import (
    MOST,
    ORDERS,
    Along,
    jumps,
    orders_of,
    peaks,
    seen,
    spectrum,
    spots,
)
from rtctl.plants.graph.description import Sensor
from rtctl.plants.graph.elements import contacts, undriven
from rtctl.plants.graph.layout import layout
from rtctl.plants.linear import MOST_SENSORS

QUICK = 2.0  # times the observer's bandwidth: fastest ripple that its correction shows
WAVES = 24  # wavelengths a decade, from a fiftieth of the travel to twice the travel
ROWS = 8000  # rows of a spectrum, about: longer recordings are thinned
SMOOTH = 51  # rows: window of a rate
CALM = 5e-3  # s: step of the difference quotients of a speed and an acceleration
SLIPPING = (0.8, 0.92, 0.97, 0.99, 0.997)  # shares of the time that a contact may hold
HOLDING = (0.995, 0.97, 0.9)  # shares of the time that a joint may hold
GAUGE = "gauge of "  # prefix of the name of a joint


def combined(like: Likelihood, model: GraphModel) -> dict[str, list]:
    """Hints of all recordings by kind, in turns from the first recording on, without repetition."""
    found = [hints(part.sim, model, part.rows[0]) for part in like.parts]
    out = found[0]
    for kind in out if len(found) > 1 else ():
        if kind.startswith("jump"):  # the time of a jump belongs to one recording
            continue
        merged: list[Any] = []
        for rank in range(MOST):
            merged += [h[kind][rank] for h in found if rank < len(h.get(kind, ())) and h[kind][rank] not in merged]
        out[kind] = merged[:MOST]
    return out


def hints(sim: Simulator, model: GraphModel, begin: int) -> dict[str, list]:
    """Hints by kind (and node): order, wavelength, spot, grip of a joint, and jump (time, size) of a sensor.

    The residual of a sensor that the observer does not follow shows orders and wavelengths.
    """
    record = sim.record
    gauges = gauged(model)
    read, _ = sim.everything(gauges)
    _, push = faster(sim).everything(model)
    push = push[begin:] if np.isfinite(push[begin:]).all() else np.zeros_like(push[begin:])
    thin = max(1, len(push) // ROWS)
    ways = [way(sim, number)[begin:] for number in range(len(sim.followed))]
    rates = [uniform_filter1d(np.abs(np.gradient(x)) / record.dt, SMOOTH)[::thin] for x in ways]
    ways, push = [x[::thin] for x in ways], push[::thin]
    quick = QUICK * faster(sim).follow
    found: dict[str, list] = {}

    def orders_at(body: str, by: np.ndarray | float = 1.0) -> list[float]:
        """Orders of the missing force in the angle of a body; `by` (n,) is proportional to their amplitude."""
        number, ratio = sim.leader(body), sim.ratios[body]
        along, rate = Along(ways[number] * ratio, by), rates[number] * abs(ratio)
        return listed(along, True, lambda grid: seen(along, push[:, number], rate, grid, quick))

    def misread(name: str) -> list[float]:
        """Orders or wavelengths of the reading error of a followed sensor, along the motion of the model."""
        sensor = sim.case.machine.sensors[name]
        body = str(sensor.body)
        number, ratio, v = sim.leader(body), sim.ratios[body], read[begin:, sim.column(name)]
        v = v if sensor.measures == "speed" else np.gradient(v) / record.dt
        if not np.isfinite(v).all():
            return []
        along = Along(ways[number] * ratio, motion=(v[::thin], (np.gradient(v) / record.dt)[::thin]))
        rate, turns = rates[number] * abs(ratio), sim.case.machine.turns(body)
        return listed(along, turns, lambda grid: seen(along, push[:, number], rate, grid, quick))

    for node, ratio in sim.ratios.items():
        x, d = ways[sim.leader(node)], push[:, sim.leader(node)]
        if ratio != 0.0 and sim.case.machine.turns(node):
            found[f"order:{node}"] = orders_at(node)
        elif ratio != 0.0:
            found[f"wavelength:{node}"] = listed(Along(x * ratio), False, partial(spectrum, Along(x * ratio), d))
            found[f"order:{node}"] = []
    for name, column in sim.layout.drives.items():  # torque ripple is proportional to the command
        body = str(sim.case.machine.drives[name].body)
        if sim.ratios.get(body, 0.0) != 0.0 and sim.case.machine.turns(body):
            found[f"order:{name}"] = orders_at(body, sim.volts[begin:, column][::thin])
    errors: dict[str, np.ndarray] = {}  # of the sensors that the observer does not follow
    tracked = {one.sensor for one in sim.followed}
    for name, sensor in sim.case.machine.sensors.items():
        body = str(sensor.body)
        ratio = sim.ratios.get(body, 0.0) if name in sim.channels else 0.0
        if ratio == 0.0 or sensor.measures not in ("position", "speed"):
            continue
        kind = "order" if sim.case.machine.turns(body) else "wavelength"
        error = (record.y[name] - read[:, sim.column(name)])[begin:][::thin]
        if name in tracked:
            found[f"{kind}:{name}"] = misread(name)
        elif sensor.measures == "speed" or not np.isfinite(error).all():
            found[f"{kind}:{name}"] = found[f"{kind}:{body}"]
        else:
            errors[name], along = error, Along(ways[sim.leader(body)] * ratio)
            found[f"{kind}:{name}"] = listed(along, kind == "order", partial(spectrum, along, error))
    for name, joint in sim.case.machine.joints.items():
        for end in ("from", "to"):
            body = getattr(joint, end)
            orders, x = found.get(f"order:{body}", []), ways[sim.leader(body)]
            for error in errors.values() if orders else ():
                turned = Along(x * sim.ratios[body])
                orders = listed(turned, True, partial(spectrum, turned, error))
            found[f"order_{end}:{name}"] = orders
    for name in sim.layout.links:
        at = gauges.layout.sensors.get(GAUGE + name)
        pull = np.abs(read[begin:, at]) if at is not None else np.full(1, np.nan)
        found[f"grip:{name}"] = [float(np.quantile(pull, q)) for q in HOLDING] if np.isfinite(pull).all() else []
    found |= grips(sim, model)
    found["spot"] = spots(ways[0], push[:, 0], MOST)
    for name in sim.channels:
        grain = record.grain[name]
        if grain > 0.0 and name in sim.layout.sensors and sim.case.machine.sensors[name].measures == "position":
            error = (record.y[name] - read[:, sim.column(name)]) / grain
            found[f"jump:{name}"] = [
                (float(record.t[k] - record.t[0]), size * grain) for k, size in jumps(error, 1.0)
            ]  # fmt: skip
    return found


def grips(sim: Simulator, model: GraphModel, shares: tuple[float, ...] = SLIPPING) -> dict[str, list]:
    """Limits at which each contact holds for these `shares` of the time, by the rigid bodies behind the contact.

    The bodies behind a contact are those that a drive moves only through the contact.
    """
    record, machine, values = sim.record, sim.case.machine, model.base
    w = max(1, round(CALM / record.dt))
    if len(record.t) <= 4 * w:
        return {}
    found: dict[str, list] = {}
    for node, contact in contacts(machine).items():
        at = lever(sim.layout, values, node, True)
        assert at is not None
        moved = at[1] * sim.ratios[at[0]]
        if moved == 0.0:
            continue
        x = way(sim, sim.leader(at[0]))
        v = (x[2 * w :] - x[: -2 * w]) / (2 * w * record.dt)
        a = (x[2 * w :] - 2 * x[w:-w] + x[: -2 * w]) / (w * record.dt) ** 2
        force = np.zeros(len(v))
        for name in {node} if not contact.joint else undriven(machine, contact.joint):
            own, key = sim.ratios[name], "inertia" if machine.turns(name) else "mass"
            force += own**2 * (values[f"bodies.{name}.{key}"] * a + values.get(f"bodies.{name}.viscous", 0.0) * v)
            force += abs(own) * values.get(f"bodies.{name}.dry", 0.0) * np.sign(v)
        found[f"grip:{node}"] = [float(f) for f in np.quantile(np.abs(force / moved), shares)]
    return found


def listed(along: Along, turns: bool, height: Callable[[np.ndarray], np.ndarray]) -> list[float]:
    """Orders, or wavelengths, m, of a body that slides, with the highest peaks of `height`.

    `height` maps orders (n,), rad^-1 or m^-1, to heights (n,).
    """
    if turns:
        return orders_of(float(np.ptp(along.angle)), height(ORDERS), MOST)
    waves = waves_of(along.angle)
    return peaks(waves, height(2 * np.pi / waves), MOST)


def waves_of(x: np.ndarray) -> np.ndarray:
    """Wavelengths (2 WAVES,), m, that are tried along positions x (n,), m."""
    return (float(np.ptp(x)) or 1.0) * np.geomspace(0.02, 2.0, 2 * WAVES)


def gauged(model: GraphModel) -> GraphModel:
    """Model with a force sensor in each spring, up to the largest number of sensors of a machine."""
    machine = model.layout.machine
    room = MOST_SENSORS - len(machine.sensors)
    more = {
        GAUGE + name: Sensor(joint=name, measures="force", column=GAUGE + name)
        for name in list(model.layout.links)[:room]
    }
    return model._replace(layout=layout(machine.model_copy(update={"sensors": {**machine.sensors, **more}})))


def faster(sim: Simulator) -> Simulator:
    """Simulator with a faster observer, which shows missing forces over a wider band."""
    return sim.following(3.0)
