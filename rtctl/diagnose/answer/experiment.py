"""Experiment design where a recording leaves several models probable: T-optimality.

Each rival in turn is the machine: its closed loop is simulated with every motion of a menu. The simulated recording is
judged by the likelihood of each other rival under the tracking observer, with the noise of the real recording. A rival
may refit its own and the nominal parameters to the simulated recording. The remaining loss is the expected gain in log
probability of the right rival, in nats. The experiment is the motion with the largest gain between the least distinct
pair.

Source: Atkinson & Fedorov, The design of experiments for discriminating between two rival models, Biometrika 62 (1975).
"""

import math
from collections.abc import Sequence
from copy import copy
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.diagnose.answer import words
from rtctl.diagnose.answer.motions import Limits, Motion
from rtctl.diagnose.answer.plan import FULL, OVER, SPEED_OVER, Experiment, chosen, eased, limits_in
from rtctl.diagnose.answer.si_format import nice
from rtctl.diagnose.calibration import SURE
from rtctl.diagnose.evidence.verdict import ALIKE, Verdict
from rtctl.diagnose.likelihood.descent import derivatives
from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.likelihood import Likelihood, coarsened
from rtctl.diagnose.likelihood.linear import DAMPING, Linear
from rtctl.diagnose.likelihood.solver import bounded_step
from rtctl.diagnose.model import loop
from rtctl.diagnose.model.loop import Loop
from rtctl.diagnose.model.loop_of import loop_of
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.model.simulate import Simulator
from rtctl.plants.graph.description import Description

CLEAR = math.log(SURE / (1.0 - SURE))  # nats, least gain with which one of two rivals is named
NEAR = 0.5 * (1.0 - SURE)  # least probability of a rival


class Planned(NamedTuple):
    """Plan of the next recording: an experiment, or the reason for none; neither where one model is probable."""

    experiment: Experiment | None = None
    untold: str = ""


class Trial(NamedTuple):
    """Gains (rivals, rivals) in nats of the row's model, which is the machine, over the column's, and the number of
    innovations; or the reason why a motion cannot be run."""

    gains: np.ndarray
    size: int
    trouble: str = ""


def planned(record: GraphRecord, decided: Verdict) -> Planned:
    """Experiment that separates the probable models of a verdict."""
    rivals = left(decided)
    if len(rivals) < 2 or record.case.problem != "driven" or not record.case.machine.drives:
        return Planned()
    names = called(record.case.machine, rivals)
    told = f"{', '.join(names[:-1])} and {names[-1]}"
    try:
        found = design(record, rivals, decided.best)
    except NoAnswer as error:
        return Planned(untold=f"{told} cannot be separated by a motion: {error}.")
    if found.nats[found.name] < CLEAR:
        tried = ", ".join(name.replace("_", " ") for name in found.nats)
        return Planned(untold=f"{told} cannot be separated by any of these motions: {tried}.")
    return Planned(found)


def left(decided: Verdict) -> tuple[Fitted, ...]:
    """Probable models, at most three, the most probable first."""
    fits: dict[tuple[str, ...], Fitted] = {}
    for rival in decided.table:
        if not rival.unlisted:
            fits.setdefault(rival.fit.names, rival.fit)
    return tuple(fits[names] for names, p in decided.probabilities if p > NEAR)[:ALIKE]


def design(record: GraphRecord, rivals: Sequence[Fitted], best: Fitted) -> Experiment:
    """Experiment with the motion of the menu that separates the rivals best, within the limits of the recorded motion.

    The noise is that of `best`. Raises NoAnswer where no motion stays within the limits.
    """
    bench = Bench(record, best)
    labels = [" + ".join(f.names) or "nothing" for f in rivals]
    motions: dict[str, Motion] = {}
    pairs: dict[str, dict[str, float]] = {}
    nats: dict[str, dict[str, float]] = {}
    refused: dict[str, str] = {}

    def trial(motion: Motion) -> Trial:
        return bench.trial(motion, rivals)

    for motion, outcome in eased(bench.limits, trial):
        if outcome.trouble:
            refused[motion.name] = outcome.trouble
            continue
        motions[motion.name] = motion
        power = coarsened(outcome.size)
        gain = {
            f"{labels[i]} / {labels[j]}": max(float(min(outcome.gains[i, j], outcome.gains[j, i])), 0.0)
            for i, j in combinations(range(len(rivals)), 2)
        }
        nats[motion.name] = gain
        pairs[motion.name] = {pair: math.sqrt(2.0 * x / power / outcome.size) for pair, x in gain.items()}
    best_name, least = chosen(motions, nats, refused, CLEAR)
    pair = {name: min(found, key=found.__getitem__) for name, found in nats.items()}
    return Experiment(
        motions[best_name], bench.limits, tuple(labels), tuple(called(record.case.machine, rivals)),
        {name: pairs[name][pair[name]] for name in nats}, pairs, refused, least,
    )  # fmt: skip


class Bench:
    """Recorded machine on which experiments are simulated."""

    def __init__(self, record: GraphRecord, best: Fitted):
        self.record, self.noise = record, best.like.parts[0]
        self.loop: Loop = loop_of(record)
        self.sim = Simulator(record)

    @cached_property
    def limits(self) -> Limits:
        """Limits of travel, speed and command of the recording, from the feedback sensor."""
        record, at = self.record, self.loop
        most = at.limit if math.isfinite(at.limit) else float(np.abs(record.u).max()) / FULL
        drive = next(iter(record.case.machine.drives.values()))
        x = at.per_unit * record.y[at.sensor]
        grain = abs(at.per_unit) * record.grain[at.sensor]
        return limits_in(x, record.dt, at.unit, drive.unit, grain, FULL * most, SPEED_OVER)

    def trial(self, motion: Motion, rivals: Sequence[Fitted]) -> Trial:
        """Expected gains of one motion between the rivals."""
        count, likes = len(rivals), []
        for f in rivals:
            sim, trouble = self.recorded(motion, f.model)
            if sim is None:
                return Trial(np.zeros((0, 0)), 0, trouble)
            likes.append(self.judge(sim))
        remains = np.array([[remaining(like, f) for f in rivals] for like in likes])  # [machine, model]
        return Trial(remains - np.diag(remains)[:, None] if count else remains, likes[0].size)

    def recorded(self, motion: Motion, model: GraphModel) -> tuple[Simulator | None, str]:
        """Simulated recording of a motion on the machine of a model; None and the reason where it cannot be made."""
        record, at, limits = self.record, self.loop, self.limits
        n = round(motion.seconds / record.dt)
        t = np.arange(n) * record.dt
        first = {name: y[0] for name, y in record.y.items()}
        ref = at.per_unit * first[at.sensor] + motion.reference(t)
        begin = record.u[0] if at.known else at.beside
        blank = record._replace(
            t=t, ref=ref, w=np.zeros(n), u=np.tile(begin, (n, 1)),
            y={name: np.full(n, value) for name, value in first.items()},
            edges={name: np.zeros(n) for name in record.edges},
            forces=None if record.forces is None else np.zeros((n, record.forces.shape[1])),
            positions={body: np.full(n, x[0]) for body, x in record.positions.items()},
        )  # fmt: skip
        out, volts = loop.run(Simulator(blank, self.sim.follow), at, model, ref, blank.w)
        trouble = self.trouble(out, volts, limits, float(first[at.sensor]))
        if trouble:
            return None, trouble
        machine, column = record.case.machine, self.sim.column
        y = {name: counted(machine, name, out[:, column(name)]) for name in record.y}
        edges = {name: passed(machine, name, out[:, column(name)]) for name in record.edges}
        made = Simulator(blank._replace(u=volts, y=y, edges=edges), self.sim.follow)
        return (made.directed(model) if edges else made), ""

    def trouble(self, out: np.ndarray, volts: np.ndarray, limits: Limits, first: float) -> str:
        """Reason why a motion cannot be run on the machine; "" where it can."""
        if not np.isfinite(out).all():
            return "a rival model diverges"
        most = float(np.abs(volts).max())
        if most > limits.command:
            unit = limits.command_unit
            return f"it needs {nice(most, unit)}, and the limit is {nice(limits.command, unit)}"
        x = self.loop.per_unit * (out[:, self.sim.column(self.loop.sensor)] - first)
        room = OVER * (limits.high - limits.low)
        if x.min() < limits.low - room or x.max() > limits.high + room:
            return "a rival model leaves the travel"
        return ""

    def judge(self, sim: Simulator) -> Likelihood:
        """Likelihood of a simulated recording, with the noise of the real recording."""
        known = dict(zip(self.noise.sim.channels, self.noise.noise, strict=True))
        sim = copy(sim)
        sim.channels = [name for name in sim.channels if name in known]
        noise = [known[name].averaged() for name in sim.channels]
        if len(noise) < len(known):  # cross terms of the noise go by the order of the sensors
            noise = [one._replace(beside=()) for one in noise]
        return Likelihood(sim, noise)


def remaining(like: Likelihood, f: Fitted) -> float:
    """Half the sum of squares of innovations and prior, nats, of a model refitted to a recording in one step."""
    power = coarsened(like.size)
    J = derivatives(like, f.space, f.x, range(len(f.x)))
    linear = Linear(f._replace(like=like, e=like.raw(f.model), J=J))
    r, white, weight = like.white(linear.base.e), linear.white, linear.weight
    low, high = f.space.bounds()
    H = power * white.T @ white + np.diag(weight)
    dx = bounded_step(H, power * white.T @ r, f.x, low, high, DAMPING)
    rest = r + white @ dx
    return float(0.5 * power * rest @ rest + 0.5 * weight @ dx**2)


def counted(machine: Description, name: str, y: np.ndarray) -> np.ndarray:
    """Quantised reading (n,), SI: for a counter the middle of the count."""
    sensor = machine.sensors.get(name)
    if sensor is None or not sensor.grain:
        return y
    step = abs(sensor.grain / sensor.scale)
    return step * (np.floor(y / step) + 0.5) if sensor.counts_per_unit is not None else step * np.round(y / step)


def passed(machine: Description, name: str, y: np.ndarray) -> np.ndarray:
    """Counts (n,) of a sensor without direction at readings (n,), SI."""
    counts = np.floor(y * machine.sensors[name].scale)
    return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(counts)))])


def called(machine: Description, rivals: Sequence[Fitted]) -> list[str]:
    """Rivals in words, without their common effects where the other effects distinguish the rivals."""
    common = set(rivals[0].names).intersection(*(f.names for f in rivals[1:]))
    parts = [[n for n in f.names if n not in common] for f in rivals]
    said = [" with ".join(words.called(machine, n) for n in part) or "no further effect" for part in parts]
    return said if len(set(said)) == len(said) else [" + ".join(f.names) for f in rivals]
