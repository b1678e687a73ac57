"""Closed loop around a described machine: its own law where that is known, else a stand-in that keeps it on a motion.

The law is known where the recording is of our own daemon, with a law of the program's, or where a case of exchange
format 1 says it. A law in an own file that came with a recording is never run. The stand-in is a PD on the main
sensor, as quick as the observer, beside the median of the recorded commands.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from rtctl.diagnose.model import kernel
from rtctl.diagnose.model.kernel import TRACK
from rtctl.diagnose.model.model import GraphModel, carried, moved_inertia, nominal, rigid
from rtctl.diagnose.model.prepare import path_of, pushing, ready
from rtctl.diagnose.model.recording import GraphRecord, levers
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.record import law
from rtctl.diagnose.record.law import LawParams
from rtctl.diagnose.record.law_params import LARGE, began, law_params, law_state, neutral, of_settings
from rtctl.idiom import fill_record, record_dtype
from rtctl.laws import pd
from rtctl.laws.limit import LimitParams
from rtctl.own.files import OwnError
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.linearised import ringing
from rtctl.plants.graph.params import GraphParams
from rtctl.plants.graph.term_units import turns_at
from rtctl.plants.graph.units import measured_unit

SLOWER = 0.2  # of the lowest natural frequency: bandwidth of a stand-in, at most
DAMPED = 1.4  # times the bandwidth, rate of the stand-in's damping
FILTER = 10.0  # times the bandwidth, that of its derivative
SLOWEST = 1e-3  # Hz, below which it is a free motion
COARSE = 1e-3  # s, substep of params that are only asked for poles and inertias
METRES = "m"  # unit of a law that does not count in its sensor's


class Loop(NamedTuple):
    """A law, and how it is wired."""

    law: LawParams
    state: np.ndarray  # (1,) at the first row
    sensor: str
    scale: float  # the law's reading for one SI unit of the sensor
    give: np.ndarray  # (drives, 2) command of each drive for one unit of either output
    beside: np.ndarray  # (drives,) and what it is beside them
    unit: str  # of the reference
    limit: float  # largest command of any drive; inf where nobody says
    known: bool  # whether it is the machine's own

    @property
    def per_unit(self) -> float:
        """Reference for one SI unit of the sensor."""
        return float(self.law.to_unit * self.scale)


def loop_of(record: GraphRecord) -> Loop:
    """The loop of a recorded machine."""
    own = _known(record) if record.source is not None else _of_config(record)
    return own if own is not None else stand_in(record)


def run(
    sim: Simulator, loop: Loop, model: GraphModel, ref: np.ndarray, w: np.ndarray, shaped: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Readings (n, sensors), SI, and commands (n, drives) of a model in closed loop, from the first row of `sim` on.

    `ref` and `w` (n,) are the reference, before shaping or as recordings have it (`shaped`), and the excitation.
    Readings are nan from the tick on at which the model ran away.
    """
    start = ready(sim, model, TRACK)
    n, drives = len(ref), sim.volts.shape[1]
    laws, wired = np.zeros(1, record_dtype(loop.law)), np.zeros(1, kernel.CLOSED)
    fill_record(laws[0], loop.law)
    wired["shaped"] = shaped
    wired["sensor"], wired["scale"] = start.model.layout.sensors[loop.sensor], loop.scale
    wired["give"][0, :drives], wired["beside"][0, :drives] = loop.give, loop.beside
    job = start.job
    path, pace = path_of(sim, job, start.model, float(start.offsets[0]))
    out, volts = np.full((n, start.params.ny), np.nan), np.zeros((n + 1, drives))
    volts[0] = sim.volts[0]
    done = kernel.closed_loop(sim.code).run(
        job, wired, laws, loop.state.copy(), start.p, start.states, start.slots, np.array(ref, float),
        np.array(w, float), volts, pushing(sim, start.model), sim.watched[:1] + start.offsets, path, pace, out,
    )  # fmt: skip
    out[max(done, 0) :] = np.nan
    sim.counted(out, start.offsets)
    return out, volts[1:]


def _known(record: GraphRecord) -> Loop | None:
    """The law of a machine of exchange format 1; None where it is not known."""
    source = record.source
    assert source is not None
    if not source.closed_loop:
        return None
    p, drives, sensor = law_params(source), len(record.case.machine.drives), record.main
    known = Loop(
        p._replace(origin=0.0), law_state(began(p, source), source), sensor,
        float(record.case.machine.sensors[sensor].scale), np.eye(2)[:drives], np.zeros(drives), _unit(record, sensor),
        source.case.drive.limit_volt or math.inf, True,
    )  # fmt: skip
    return known if abs(known.per_unit - 1.0) < 1e-9 else known._replace(unit=METRES)


def _of_config(record: GraphRecord) -> Loop | None:
    """The law of a described machine by the config in its case; None where there is none, or one of an own file."""
    settings = settings_of(record.case.config)
    return None if settings is None else of_machine(settings, record)


def settings_of(config: dict[str, Any] | None) -> Any:
    """Checked settings of a described machine's config, without code that came with it; None where they do not load."""
    from rtctl import machines
    from rtctl.own.model import without_code

    if config is None:
        return None
    try:
        model, data = without_code(machines.class_of(config), config)
        settings = model.model_validate(data)
    except (OwnError, ValidationError):
        return None
    return settings if hasattr(settings.law.position, "kind") else None


def of_machine(settings: Any, record: GraphRecord) -> Loop:
    """The loop of a config of a described machine, around a recording of it."""
    from rtctl.machines.described import parts_of, shares_of
    from rtctl.machines.described_plant import converter, is_counter

    parts = parts_of(settings)
    sensor = settings.machine.sensors[parts.feedback]
    counter = is_counter(sensor)
    p = of_settings(neutral(1.0 / sensor.scale, record.dt), settings.law, record.dt)
    p = p._replace(resolution=1.0 if counter else abs(sensor.grain), shift=0.0 if counter else 0.5)
    shares = shares_of(settings)
    if len(shares) == 1:
        p = p._replace(rounds=law.BOARD, output=converter(settings, 0))
    limit = min(settings.law.limit.high, most_of(settings.machine))
    give = np.column_stack([shares, np.zeros(len(shares))])
    return Loop(
        p, np.zeros(1, law.LAW_STATE), parts.feedback, float(sensor.scale), give, np.zeros(len(shares)), parts.unit,
        float(limit), True,
    )  # fmt: skip


def stand_in(record: GraphRecord) -> Loop:
    """A PD on the main sensor by the nominal model, beside the median of the recorded commands."""
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
        p, np.zeros(1, law.LAW_STATE), record.main, 1.0, give, np.median(record.u, axis=0), _unit(record, record.main),
        limit, False,
    )  # fmt: skip


def most_of(machine: Description) -> float:
    """Largest command that every drive of a machine takes, in its unit; inf where it has no drive."""
    return float(min((d.limit or d.dac_range for d in machine.drives.values()), default=math.inf))


def stand_in_law(record: GraphRecord) -> dict[str, Any]:
    """The stand-in as the `law` of a config, plain data in SI units."""
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
    """Shares (drives,) of a stand-in's output, its gain in command by rad or m (or by their rate), and its bandwidth in
    rad/s."""
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
    """Lowest frequency, Hz, at which a machine rings with its joints; inf where it does not."""
    if machine.mechanics is not None or not p.nl:
        return math.inf
    rings = np.abs(ringing(p)) / (2 * np.pi)
    return float(min(rings[rings > SLOWEST], default=math.inf))


def _unit(record: GraphRecord, sensor: str) -> str:
    machine = record.case.machine
    return measured_unit(machine.sensors[sensor].measures, turns_at(machine, machine.sensors[sensor]))
