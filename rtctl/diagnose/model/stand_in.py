"""Stand-in for an unknown law: a PD on the main sensor.

Its bandwidth is at most that of the tracking correction; its command is added to the median of the recorded commands.
"""

import math
from typing import Any

import numpy as np

from rtctl.diagnose.model.loop import Loop, most_of, unit_of
from rtctl.diagnose.model.model import GraphModel, carried, moved_inertia, nominal, rigid
from rtctl.diagnose.model.recording import GraphRecord, levers
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.record import law
from rtctl.diagnose.record.law_parts import LARGE, neutral
from rtctl.laws import pd
from rtctl.laws.limit import LimitParams
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.linearised import ringing
from rtctl.plants.graph.params import GraphParams

SLOWER = 0.2  # of the lowest natural frequency: bandwidth of a stand-in, at most
DAMPED = 1.4  # derivative time of the stand-in times its bandwidth
FILTER = 10.0  # corner of the derivative filter over the bandwidth
SLOWEST = 1e-3  # Hz, frequency below which a mode is a free motion
COARSE = 1e-3  # s, substep of params that give poles and inertias only


def stand_in(record: GraphRecord) -> Loop:
    """Loop with a PD on the main sensor by the nominal model, added to the median of the recorded commands."""
    case, model = record.case, nominal(record.case)
    sensor = case.machine.sensors[record.main]
    shares, gain, rate = _pd(record, model)
    dt, speed = record.dt, sensor.measures == "speed"
    p = neutral(1.0, dt)
    limit = most_of(case.machine)
    most = min(limit, LARGE)
    p = p._replace(
        kind=law.PD, limit=LimitParams(-most, most, math.inf),
        pd=pd.of_gains(gain, 0.0 if speed else DAMPED * gain / rate, FILTER * rate / (2 * np.pi), dt),
    )  # fmt: skip
    give = np.column_stack([shares, np.zeros(len(shares))])
    return Loop(
        p, np.zeros(1, law.LAW_STATE), record.main, 1.0, give, np.median(record.u, axis=0),
        unit_of(record, record.main), limit, False,
    )  # fmt: skip


def stand_in_law(record: GraphRecord) -> dict[str, Any]:
    """Stand-in as the `law` of a config, plain data in SI units."""
    shares, gain, rate = _pd(record, nominal(record.case))
    machine = record.case.machine
    drive = int(np.argmax(shares != 0.0))
    position: dict[str, Any] = {"kind": "pd", "gain": gain, "derivative_filter": FILTER * rate / (2 * np.pi)}
    if machine.sensors[record.main].measures != "speed":
        position["tau_d"] = DAMPED / rate
    names = list(machine.drives)
    forwards = shares[drive]
    return {
        "feedback": record.main,
        "drive": names[drive],
        "shares": {name: float(share / np.sign(forwards)) for name, share in zip(names, shares, strict=True) if share},
        "position": position,
    }


def _pd(record: GraphRecord, model: GraphModel) -> tuple[np.ndarray, float, float]:
    """Shares (drives,) of the output of a stand-in, its gain in command by rad or m (or by their rate), and its
    bandwidth in rad/s."""
    machine = record.case.machine
    sensor = machine.sensors[record.main]
    at = np.array(list(levers(model, str(sensor.body)).values()))
    moving = at != 0.0
    shares = np.sign(at) / max(int(moving.sum()), 1)
    lever = float(np.abs(at).sum() / max(int(moving.sum()), 1))
    params, ratios = model.params(COARSE), rigid(model.layout, model.base, str(sensor.body))
    inertia = moved_inertia(params.inertia, carried(model.layout, model.base, ratios))
    rate = min(Simulator(record).follow, SLOWER * 2 * np.pi * lowest_mode(machine, params))
    force = rate * inertia if sensor.measures == "speed" else rate**2 * inertia
    return shares, force / lever if lever else 0.0, rate


def lowest_mode(machine: Description, p: GraphParams) -> float:
    """Lowest natural frequency of a machine on its joints, Hz; inf without an oscillation."""
    if machine.mechanics is not None or not p.nl:
        return math.inf
    rings = np.abs(ringing(p)) / (2 * np.pi)
    return float(min(rings[rings > SLOWEST], default=math.inf))
