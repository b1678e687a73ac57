"""Runs any model against any recording: the recorded command in, readings out.

    open    the recorded command alone: a free run
    track   the recorded command plus a slow correction that makes the model follow the recorded main sensor. An error
            of the model stays where it arises instead of adding up, and its size is what the correction leaves over.
    closed  the reference in, the loop closed by the machine's own law: a free run of machine and controller

All three compare readings before they are cut into counts with counts plus a half.
"""

from copy import copy
from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.diagnose import kernel
from rtctl.diagnose.case import Case
from rtctl.diagnose.hold import half_a_tick_on
from rtctl.diagnose.kernel import CLOSED, TRACK
from rtctl.diagnose.law_params import began, law_params, law_state, per_unit
from rtctl.diagnose.model import Model, plant_params
from rtctl.diagnose.record import Record
from rtctl.diagnose.tacho import noise
from rtctl.idiom import fill_record, record_dtype
from rtctl.plants import ivu, ldu
from rtctl.plants.physics import TERMS, only, ordered
from rtctl.plants.physics.place import PLANTS

NEVER = np.iinfo(np.int64).max  # row
SUBSTEP = {"ivu": 1e-3, "ldu": 100e-6, "axis": 0.25e-3}  # s, at most: the linear part is exact at any
COARSE = 0.2e-3  # s, ticks shorter than this are taken two at a time
FINER = {"ivu": 2, "ldu": 2, "axis": 2}
FOLLOW = {"ivu": 10.0, "ldu": 30.0, "axis": 30.0}  # rad/s, bandwidth of the correction
FOLLOW_SPEED = 5.0  # rad/s: a speed does not drift, has more noise to average, and a constant force must show in it
QUICKEST = 0.25  # rad a tick: a correction that comes a tick late may not be quicker
LEAD = {"ivu": 1.0, "ldu": 0.1, "axis": 0.0}  # s at rest under the first row's voltage, until the tape is taut
SLIPS, BEHIND = only("slips"), {"ldu": "encoder"}  # body behind the contact, where most inertia is before it
SHARE = {"ivu": (0.5, -0.5), "ldu": (1.0,), "axis": (1.0,)}
CHANNELS = {"ivu": ("capstan_counts", "reel1_counts", "reel2_counts"), "ldu": ("encoder_counts", "scale_counts")}


class Simulator:
    """A recording, ready to be simulated by models; one call is one run, and calls may go on in several threads."""

    def __init__(
        self,
        record: Record,
        follow: float | None = None,
        lead: float | None = None,
        held: bool = True,
    ):
        self.record = record
        self.behind = False  # whether the correction pushes behind a contact that may slip, whatever the model
        self.case: Case = record.case
        self.kernel = kernel.kernel(record.plant)
        self.substeps = max(1, int(np.ceil(record.dt / SUBSTEP[record.plant] - 1e-9)))
        self.channels = channels(record)
        usual = FOLLOW_SPEED if record.shows_speed else FOLLOW[record.plant]
        self.follow = min(usual if follow is None else follow, QUICKEST / record.dt)
        self.lead = round((LEAD[record.plant] if lead is None else lead) / record.dt)
        self.half = 0.5 if record.plant != "axis" else 0.0
        self.seen = np.ascontiguousarray(record.y[self.channels[0]] + self.half)
        volts = record.u.reshape(len(record.t), -1)
        self.volts = np.ascontiguousarray(volts if held else half_a_tick_on(volts))
        self.ref = np.nan_to_num(np.ascontiguousarray(record.ref))
        self.w = np.array(record.w, float)  # of a file it cannot be written to, which would be compiled for anew
        self.law = began(law_params(record), record)
        self.laws = np.zeros(1, record_dtype(self.law))
        fill_record(self.laws[0], self.law)
        self.law_state = law_state(self.law, record)
        self.release = NEVER  # row at which the correction ends
        self.jolt = np.zeros(2)  # position and speed of the main sensor's body that are added there

    def released(self, row: int, jolt: np.ndarray | None = None) -> "Simulator":
        """The same whose tracking correction ends at `row`: a free run from there, from all states that the observer
        has reached.

        `jolt` (2,) is added to position (rad or m) and speed of the main sensor's body at that row, the others moving
        as on stiff springs.
        """
        other = copy(self)
        other.release = row
        other.jolt = np.zeros(2) if jolt is None else np.asarray(jolt, float)
        return other

    def finer(self, times: int) -> "Simulator":
        """The same with steps that are so many `times` shorter."""
        other = copy(self)
        other.substeps *= times
        return other

    def pushed_behind(self) -> "Simulator":
        """The same with every model corrected as one whose contact slips is: models compare under one correction."""
        other = copy(self)
        other.behind = True
        return other

    def commanded(self, volts: np.ndarray) -> "Simulator":
        """The same with other voltages (n, drives) than the recorded ones acting on the model."""
        other = copy(self)
        other.volts = np.ascontiguousarray(volts)
        return other

    def run(
        self,
        model: Model,
        mode: int = TRACK,
        n: int | None = None,
        coarse: bool = False,
        directed: bool = False,
        at: str = "",
    ) -> np.ndarray:
        """Readings (n, sensors) in the sensors' units; nan from the tick on at which the model ran away.

        `directed`: as if every counter knew its direction; `at`: the body that the correction pushes.
        """
        return self.everything(model, mode, n, coarse=coarse, directed=directed, at=at)[0]

    def everything(
        self,
        model: Model,
        mode: int = TRACK,
        n: int | None = None,
        follow: float | None = None,
        coarse: bool = False,
        directed: bool = False,
        at: str = "",
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Readings, the volts that the law wrote (CLOSED) and the correction (n,) that kept the model on track (TRACK).

        The correction is in the unit of the linear machine's input; `follow` is its bandwidth in rad/s. `coarse` takes
        twice the step in half the time: good for differences, not for verdicts. `directed`: see `run`. With `at` the
        drives have no part in the correction: it is a push at that body.
        """
        k = self.kernel
        n = len(self.seen) if n is None else n
        terms = [str(getattr(t, "term", "")) for t in model.terms]
        stiff, slips = any(term in TERMS and TERMS[term].stiff for term in terms), SLIPS in terms
        substeps = self.substeps * (FINER[self.record.plant] if stiff else 1)
        stride = 1
        coarse = coarse and not (slips and self.record.dt < COARSE)  # when it sets in is a matter of single ticks
        if coarse and self.record.dt < COARSE:
            substeps, stride = 1, 2
        elif coarse:
            substeps = (substeps + 1) // 2
        h = self.record.dt * stride / substeps
        params = plant_params(model, self.case, h)
        p = np.zeros(1, _dtype(params))
        fill_record(p[0], params)
        if len(model.terms) > kernel.SLOTS:
            raise UserError(f"physics: has {len(model.terms)} terms; {kernel.SLOTS} is the most that can be simulated")
        slots = np.zeros(1, k.slots)
        for slot, settings in zip(slots[0]["q"], ordered(list(model.terms)), strict=False):
            kernel.fill_slot(k, slot, settings, params)
        job = self._job(params, mode, self.follow if follow is None else follow, substeps, stride)
        for node, number in PLANTS[self.record.plant].NODES.items():
            job["rigid"][0, number] = gear(self.record.plant, model.base, node)
        if directed:
            job["rectified"] = 0
        past = slips or self.behind  # through the contact no drive could correct
        if past and not at:
            at = BEHIND.get(self.record.plant, "")
        if at or past:
            job["share"] = 0.0
            for node, torque in pushes(self.record, model.base, at).items():
                job["push"][0, PLANTS[self.record.plant].NODES[node]] = torque
        out = np.zeros((n, len(job["per_unit"][0])))
        written = np.zeros((n if mode == CLOSED else 1, self.volts.shape[1]))
        push = np.zeros(n)
        done = k.module.run(
            job, p, np.zeros(1, k.state), slots, self.laws, self.law_state.copy(), self.lead, self.ref[:n],
            self.w[:n], self.volts[:n], self.seen[:n], out, written, push,
        )  # fmt: skip
        out[max(done, 0) :] = np.nan
        if mode == CLOSED and self.law.origin:
            out[:, 0] += self.law.origin * self.law.resolution
        return out, written, push

    def _job(self, params: Any, mode: int, follow: float, substeps: int, stride: int) -> np.ndarray:
        case, plant = self.case, self.record.plant
        job = np.zeros(1, self.kernel.job)
        j = job[0]
        j["mode"], j["substeps"], j["rate"], j["half"] = mode, substeps, 1.0 / (stride * self.record.dt), self.half
        j["stride"] = stride
        j["release"], j["jolt"] = self.release, self.jolt
        late = case.delay_samples * self.record.dt
        if plant == "axis":  # its plant has no driver: what that holds back is a delay
            late += case.drive.late
        j["part"], j["delay"] = np.modf(late / self.record.dt * substeps)
        j["gain"] = case.drive.amp_per_volt[0] if case.drive.amp_per_volt else 1.0
        j["current_limit"] = case.drive.current_limit or np.inf
        j["per_unit"] = per_unit(case)
        j["rectified"] = [0, 1, 1] if plant == "ivu" else 0
        j["speed"] = self.record.shows_speed
        j["share"] = SHARE[plant]
        rigid = rigid_gain(params, plant)
        j["P"], j["D"] = follow**2 / rigid, 1.4 * follow / rigid
        j["a"] = -np.expm1(-10 * follow * stride * self.record.dt)
        return job


_dtypes: dict[type, np.dtype] = {}


def _dtype(params: Any) -> np.dtype:
    return _dtypes.setdefault(type(params), record_dtype(params))


def channels(record: Record) -> tuple[str, ...]:
    """Recorded sensors in the order of the plant's, those that are missing left out at the end."""
    wanted = CHANNELS.get(record.plant, tuple(record.y))
    return tuple(name for name in wanted if name in record.y)


def resolution(record: Record) -> float:
    """Step of the main sensor in rad or m: one count, what the owner says, or the smallest step that occurs. Of a
    sensor of speed its noise, per s."""
    sensors, plant = record.case.sensors, record.plant
    if plant != "axis":
        return float(1.0 / per_unit(record.case)[0])
    if sensors.x_counts_per_rev:
        return float(2 * np.pi / sensors.x_counts_per_rev)
    if sensors.x_resolution_m:
        return float(sensors.x_resolution_m)
    main, values = next(iter(record.y.items()))
    steps = np.abs(np.diff(values))
    smallest = float(np.quantile(steps[steps > 0], 0.01)) if (steps > 0).any() else 1e-12
    return max(smallest, noise(values, record.u)) if main == "speed" else smallest


def lever(record: Record, base: dict[str, float]) -> float:
    """What one unit of correction by the drives pushes with at the main sensor's node, Nm (N of an axis)."""
    if record.plant == "ivu":
        pairs = zip(SHARE["ivu"], record.case.drive.amp_per_volt, strict=True)
        return sum(abs(s) * base[f"K_m{i}"] * amp / base[f"R{i}"] for i, (s, amp) in enumerate(pairs, 1)) * base["R_c"]
    return base["K_m1"] * base["N"] if record.plant == "ldu" else base["K"]


def gear(kind: str, base: dict[str, float], node: str) -> float:
    """Turn of a body for one of the main sensor's, all springs taken as stiff."""
    if kind == "ivu" and node[-1:] in ("1", "2"):
        return base["R_c"] / base["R1"] if node.endswith("1") else -base["R_c"] / base["R2"]
    return base["N"] if kind == "ldu" and node == "motor" else 1.0


def pushes(record: Record, b: dict[str, float], at: str) -> dict[str, float]:
    """What one unit of correction pushes bodies with, Nm, where it does as much as by the drives: the one `at` a node,
    else each of the reel unit as its inertia asks for, so that all would move together if no tape held them."""
    one = lever(record, b)
    if at:
        return {at: one / gear(record.plant, b, at)}
    inertia = {"motor1": b["J_m1"], "reel1": b["J_1"], "capstan": b["J_c"], "reel2": b["J_2"], "motor2": b["J_m2"]}
    turns = {node: gear(record.plant, b, node) for node in inertia}
    whole = sum(J * turns[node] ** 2 for node, J in inertia.items())
    return {node: one * J * turns[node] / whole for node, J in inertia.items()}


def rigid_gain(params: Any, kind: str) -> float:
    """Acceleration of the main sensor for one unit of correction, all springs taken as stiff, rad/s^2 or m/s^2."""
    if kind == "axis":
        return float(params.K / params.M)
    plant = PLANTS[kind]
    A, B = plant.state_space(params)
    w = 2 * np.pi * 0.1
    sensor = {"ivu": ivu.CAPSTAN, "ldu": ldu.ENCODER, "axis": 0}[kind]
    x = np.linalg.solve(1j * w * np.eye(len(A)) - A, B @ np.array(SHARE[kind]))
    return float(np.abs(x[sensor]) * w**2)
