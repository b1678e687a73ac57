"""Preparation of a run: records of a model for the compiled simulation, at the first row of a recording."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rtctl.case.start import BEGINS, FIRST_POSITION, FIRST_SPEED, OWN_START, START
from rtctl.config.errors import UserError
from rtctl.diagnose.model import kernel
from rtctl.diagnose.model.kernel import HELD, TRACK
from rtctl.diagnose.model.model import GraphModel, carried, moved_inertia, rigid
from rtctl.diagnose.model.observer import DAMPED, SMOOTHED, Followed, stiffness
from rtctl.diagnose.model.slots import SLOTS
from rtctl.idiom import fill_record, record_dtype
from rtctl.plants.element import Element
from rtctl.plants.graph.elements import elements, spot
from rtctl.plants.graph.layout import NOWHERE, Layout
from rtctl.plants.graph.plant import GRAPH_STATE
from rtctl.plants.physics import TERMS, ordered

if TYPE_CHECKING:
    from rtctl.diagnose.model.simulate import Simulator

COARSEST = 0.25e-3  # s, longest substep where a substep is longer than a tick
RUBS = "dry"  # trait of a body with dry friction
ABSENT = np.zeros((1, 1))


class Ready(NamedTuple):
    """Model at the first row of a recording."""

    model: GraphModel  # with the numbers of the recording
    params: Any
    job: np.ndarray
    p: np.ndarray
    states: np.ndarray
    slots: np.ndarray
    offsets: np.ndarray  # (followed,) positions where their columns show 0, rad or m


def ready(sim: "Simulator", model: GraphModel, mode: int | None = None, coarse: bool = False) -> Ready:
    """Records for one run of a model, at the first row. Raises UserError for too many terms."""
    record, k = sim.record, sim.kernel
    mode = sim.mode if mode is None else mode
    model = sim.own(model).resolved().built()
    stiff = any(TERMS[str(getattr(t, "term", ""))].stiff for t in model.terms)
    substeps = sim.substeps * (2 if stiff else 1)
    coarse = coarse and not any(TERMS[str(getattr(t, "term", ""))].slips for t in model.terms)  # slip needs fine steps
    whole = sim.mode == HELD or bool(sim.inputs) or sim.case.machine.mechanics is not None  # needs every tick
    stride = max(1, int(COARSEST / record.dt)) if coarse and sim.substeps == 1 and not whole else 1
    substeps = 1 if stride > 1 else (substeps + 1) // 2 if coarse else substeps
    h = record.dt * stride / substeps
    params = model.params(h)
    p = np.zeros(1, _dtype(params))
    fill_record(p[0], params)
    if len(model.terms) > SLOTS:
        raise UserError(f"physics: has {len(model.terms)} terms; at most {SLOTS} can be simulated")
    slots = np.zeros(1, k.slots)
    acting = [t for t in ordered(list(model.terms)) if TERMS[str(getattr(t, "term", ""))].act]
    same = model.layout is sim.layout or model.layout.machine.joints == sim.layout.machine.joints  # or with more gauges
    there = sim.elements if same else places(model.layout)
    for slot, settings in zip(slots[0]["q"], acting, strict=False):
        s: Any = settings
        kernel.fill_slot(k, slot, s, spot(TERMS[s.term], s, model.layout, there, model.base), h)
    job = _job(sim, model, params, mode, substeps, stride)
    states = np.zeros(1, GRAPH_STATE)
    offsets = np.array([start_of(sim, one, model.base) for one in sim.followed])
    _begin(sim, states, model, sim.watched[0] + offsets)
    return Ready(model, params, job, p, states, slots, offsets)


def places(layout: Layout) -> tuple[Element, ...]:
    """Elements of a machine. Every body may have dry friction, whether or not the description declares it."""
    return tuple(e._replace(traits=e.traits | {RUBS}) if e.kind == "body" else e for e in elements(layout))


def path_of(sim: "Simulator", job: np.ndarray, model: GraphModel, start: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions and speeds (n, coordinates) of the held coordinates, which are marked in the job."""
    moved = list(sim.inputs)
    if job["mode"][0] == HELD:
        assert sim.held is not None
        moved.append(sim.held._replace(x=sim.held.x + start) if start else sim.held)
    if not moved:
        return ABSENT, ABSENT
    path, pace = np.zeros((2, len(sim.seen), model.layout.nq))
    job["holds"] = 1
    for one in moved:
        at, ratio = model.layout.coordinate(one.body), model.layout.ratio(one.body, model.base)
        path[:, at], pace[:, at] = one.x / ratio, one.v / ratio
        job["held"][0, at] = 1
        job["share"][0, at] = 1.0 / ratio if one is moved[-1] else 0.0
    return path, pace


def pushing(sim: "Simulator", model: GraphModel) -> np.ndarray:
    """Forces (n, coordinates) of a model that may have more coordinates than the description, N or Nm."""
    if len(sim.forces) < 2 or model.layout is sim.layout:
        return sim.forces
    out = np.zeros((len(sim.forces), model.layout.nq))
    first: dict[int, str] = {}
    for name, body in sim.layout.bodies.items():
        first.setdefault(body.coordinate, name)
    for at, name in first.items():
        if at != NOWHERE:
            out[:, model.layout.coordinate(name)] += sim.forces[:, at]
    return out


def start_of(sim: "Simulator", one: Followed, base: dict[str, float]) -> float:
    """Position of a followed body where its column shows 0, rad or m."""
    machine = sim.case.machine
    first = base.get(START, 1.0) if one.sensor == sim.main else 1.0
    offset = float(np.log(first * base.get(f"{BEGINS}.{one.body}", 1.0)))
    if machine.mechanics is not None and not one.shows_speed:
        offset += machine.mechanics.at.get(one.body, 0.0)
    return offset


def _begin(sim: "Simulator", states: np.ndarray, model: GraphModel, first: np.ndarray) -> None:
    """Set every coordinate to the first row of the followed sensors, with unstretched joints."""
    x = states["m"]["x"][0]
    mechanics = sim.case.machine.mechanics
    for name, place in (mechanics.at if mechanics is not None else {}).items():
        x[model.layout.coordinate(name)] = place / model.layout.ratio(name, model.base)
    first, rate = first.copy(), 0.0
    if sim.case.problem == "free":
        first[0] += sim.record.scales[0] * float(np.log(model.base[FIRST_POSITION]))
        rate = sim.record.scales[2] + sim.record.scales[1] * float(np.log(model.base[FIRST_SPEED]))
    for number in range(len(sim.followed) - 1, -1, -1):
        one = sim.followed[number]
        position, speed = (0.0, first[number]) if one.shows_speed else (first[number], 0.0)
        if number == 0:
            speed = rate or speed
            if sim.begins is not None:
                position, speed = sim.begins[0] + start_of(sim, one, model.base), sim.begins[1]
        for name, ratio in rigid(sim.layout, sim.case.values, one.body).items():
            if ratio == 0.0:
                continue
            at, own = model.layout.coordinate(name), model.layout.ratio(name, model.base)
            if position or not one.shows_speed:
                x[at] = ratio * position / own
            if speed:
                x[model.layout.nq + at] = states["m"]["v_before"][0, at] = ratio * speed / own


def _job(sim: "Simulator", model: GraphModel, params: Any, mode: int, substeps: int, stride: int) -> np.ndarray:
    """Job of a run, (1,) JOB: timing, observer, and the distances of fitted starts from rest."""
    job = np.zeros(1, kernel.JOB)
    j = job[0]
    dt = sim.record.dt * stride
    j["stride"] = stride
    j["mode"], j["substeps"], j["rate"], j["release"] = mode, substeps, 1.0 / dt, sim.release
    j["lead"] = sim.lead if mode == TRACK and sim.begins is None else 0
    j["part"], j["delay"] = np.modf(sim.case.delay_samples * substeps)
    j["follows"] = len(sim.followed)
    for number, one in enumerate(sim.followed):
        j["main"][number], j["speed"][number] = model.layout.sensors[one.sensor], one.shows_speed
        moved = carried(model.layout, model.base, rigid(sim.layout, sim.case.values, one.body))
        for at, ratio in moved.items():
            j["way"][number, at] = ratio
        inertia = moved_inertia(params.inertia, moved)
        follow = sim.bandwidth(one)
        j["P"][number], j["D"][number] = stiffness(follow, inertia)
        j["K"][number], j["L"][number] = (
            (0.0, DAMPED * follow * dt) if one.shows_speed else (DAMPED * follow * dt, follow**2 * dt)
        )
        j["a"][number] = -np.expm1(-SMOOTHED * follow * dt)
    for path, value in model.base.items():
        if path.startswith(OWN_START):
            name, what = path.removeprefix(OWN_START).rsplit(".", 1)
            at, column = model.layout.coordinate(name), ("position", "speed").index(what)
            j[("first_x", "first_v")[column]][at] = _own_scales(sim, params, at)[column] * float(np.log(value))
    return job


def _own_scales(sim: "Simulator", params: Any, at: int) -> tuple[float, float]:
    """Scales of the first position and speed of a coordinate: of a free oscillation with the speed of the machine."""
    ratio = next((r / sim.layout.ratio(name, sim.case.values) for name, r in sim.ratios.items()
                  if r and sim.layout.coordinate(name) == at), 1.0)  # fmt: skip
    stiffness = sum(c for end, c in stiff_ends(params) if end == at)
    speed = sim.pace * abs(ratio)
    return speed * float(np.sqrt(params.inertia[at] / stiffness)) if stiffness else 0.0, speed


def stiff_ends(params: Any) -> list[tuple[int, float]]:
    """Coordinate and stiffness, N/m or Nm/rad, of each end of each spring."""
    return [
        (int(at), float(params.link_c[k] * lever**2))
        for k in range(params.nl)
        for at, lever in ((params.link_i[k], params.link_a[k]), (params.link_j[k], params.link_b[k]))
    ]


_dtypes: dict[type, np.dtype] = {}


def _dtype(params: Any) -> np.dtype:
    if type(params) not in _dtypes:
        _dtypes[type(params)] = record_dtype(params)
    return _dtypes[type(params)]
