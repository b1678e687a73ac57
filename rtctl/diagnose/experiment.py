"""The experiment to run next, when a recording leaves several models in the running.

Every rival is simulated with every motion of a menu, the loop closed by the machine's own law (where that is not known:
kept on the motion by a slow correction). The motion whose readings differ most between the rivals, over the noise, is
the one to run: T-optimality. What a rival could make up for by other values of its own terms does not count.

Source: Atkinson & Fedorov, The design of experiments for discriminating between two rival models, Biometrika 62 (1975).
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.kernel import CLOSED, TRACK
from rtctl.diagnose.law import LawParams
from rtctl.diagnose.model import Model
from rtctl.diagnose.motions import Limits, Motion
from rtctl.diagnose.numbers import nice
from rtctl.diagnose.plan import FULL, OVER, SPEED_OVER, Experiment, chosen, eased, limits_in
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.quantities import Quantities, of_case
from rtctl.diagnose.record import Record
from rtctl.diagnose.simulate import SHARE, Simulator, resolution
from rtctl.diagnose.words import at

STILL = 0.05  # s in which a sensor at rest does not change by a count
LEAST = 0.05  # distance over the noise below which nothing is told apart
STEP = 0.02  # of a value, in difference quotients


class Outcome(NamedTuple):
    """What the rivals do under one motion."""

    readings: list[np.ndarray]  # of each rival, (rows, channels), over sigma
    slopes: list[list[np.ndarray]]  # of each rival, by each number of its own terms
    moves: list[np.ndarray]  # of each rival, (rows,) whether the sensors change
    trouble: str  # why the motion cannot be run; "" where it can


def design(record: Record, rivals: Sequence[Model], sim: Simulator | None = None) -> Experiment:
    """The motion of the menu that tells the rivals apart best, within what the machine did in the recording.

    `sim` is a Simulator of that recording where there is one. Of more than two rivals the pair that is hardest to
    tell apart counts, unless no motion tells it apart at all. Raises ValueError for fewer than two rivals and NoAnswer
    where no motion stays within the limits.
    """
    if len(rivals) < 2:
        raise ValueError(f"an experiment separates at least two models; {len(rivals)} given")
    sim = Simulator(record) if sim is None else sim
    problem, limits = Problem(sim), limits_of(sim)
    labels = names_of(rivals)
    motions: dict[str, Motion] = {}
    pairs: dict[str, dict[str, float]] = {}
    refused: dict[str, str] = {}
    for motion, outcome in eased(limits, lambda motion: simulate(problem, limits, rivals, motion)):
        if outcome.trouble:
            refused[motion.name] = outcome.trouble
            continue
        motions[motion.name] = motion
        pairs[motion.name] = {
            f"{labels[i]} / {labels[j]}": distance(outcome, i, j) / problem.floor
            for i, j in combinations(range(len(rivals)), 2)
        }
    best, worst = chosen(motions, pairs, refused, LEAST)
    said = called(labels, of_case(sim.case))
    return Experiment(motions[best], limits, labels, tuple(said), worst, pairs, refused)


def names_of(rivals: Sequence[Model]) -> tuple[str, ...]:
    """Each rival by its terms, as term:node; numbered where two are alike."""
    plain = [" + ".join(f"{t.term}:{t.node}" for t in model.terms) or "nothing" for model in rivals]  # type: ignore[attr-defined]
    return tuple(f"{n} ({plain[:i].count(n) + 1})" if plain.count(n) > 1 else n for i, n in enumerate(plain))


def called(rivals: Sequence[str], units: Quantities) -> list[str]:
    """Rivals, each as `names_of` has it, as a person calls them: what they have in common is left out."""
    parts = [rival.split(" + ") for rival in rivals]
    common = set(parts[0]).intersection(*parts[1:])
    names = [" with ".join(at(entry, units) for entry in part if entry not in common) or "no more" for part in parts]
    return names if len(set(names)) == len(names) else list(rivals)


def limits_of(sim: Simulator) -> Limits:
    """Travel, speed and command of the recording, from the main sensor."""
    record, drive = sim.record, sim.case.drive
    return limits_in(
        to_position(sim) * (sim.seen - sim.half), record.dt,
        "rad" if record.plant == "ivu" else (sim.case.sensors.unit or "m"), of_case(sim.case).command,
        to_position(sim) * smallest_step(sim),
        FULL * drive.limit_volt if drive.limit_volt else float(np.abs(record.u).max()), SPEED_OVER,
    )  # fmt: skip


def smallest_step(sim: Simulator) -> float:
    """What the main sensor can show at least, in its own unit."""
    return resolution(sim.record) if sim.record.plant == "axis" else 1.0


def to_position(sim: Simulator) -> float:
    """Reference's unit for one unit of the main sensor."""
    law: LawParams = sim.law
    return float(law.to_unit)


def simulate(problem: Problem, limits: Limits, rivals: Sequence[Model], motion: Motion) -> Outcome:
    """Readings of all rivals under the motion, and their slopes by the numbers of the terms."""
    blank = prepared(problem.sim, motion, rivals[0])
    readings, slopes = [], []
    for model in rivals:
        out, trouble = respond(blank, limits, model)
        if trouble:
            return Outcome([], [], [], trouble)
        readings.append(weighed(problem, out))
    for model, y in zip(rivals, readings, strict=True):
        found = []
        for moved in neighbours(model):
            slope = weighed(problem, respond(blank, limits, moved)[0]) - y
            if np.isfinite(slope).all():
                found.append(slope)
        slopes.append(found)
    moves = [moving(problem, y) for y in readings]
    return Outcome(readings, slopes, moves, "")


def prepared(sim: Simulator, motion: Motion, first: Model) -> Simulator:
    """A Simulator for the motion; where the law is not known, with the command that the first rival would need."""
    record = sim.record
    n = round(motion.seconds / record.dt)
    t = np.arange(n) * record.dt
    ref = motion.reference(t)
    y = {name: np.zeros(n) for name in record.y}
    y[sim.channels[0]] = ref / to_position(sim) - sim.half
    start = record.u[0] if record.closed_loop else np.median(record.u, axis=0)
    blank = record._replace(t=t, ref=ref, w=np.zeros(n), u=np.tile(start, (n, 1)), y=y, columns={})
    lead = sim.lead * record.dt
    made = Simulator(blank, follow=sim.follow, lead=lead)
    if record.closed_loop:
        return made
    push = made.everything(first, TRACK)[2]
    return Simulator(blank._replace(u=blank.u + volts_of(made, push)), follow=sim.follow, lead=lead)


def respond(sim: Simulator, limits: Limits, model: Model) -> tuple[np.ndarray, str]:
    """Readings (n, sensors), and why this cannot be done with the machine, or nothing."""
    mode = CLOSED if sim.record.closed_loop else TRACK
    out, volts, push = sim.everything(model, mode)
    if not np.isfinite(out).all():
        return out, "a rival runs away"
    if mode == TRACK:
        volts = sim.volts + volts_of(sim, push)
    most = float(np.abs(volts).max())
    if most > limits.command:
        unit = limits.command_unit
        return out, f"it takes {nice(most, unit)}, and {nice(limits.command, unit)} are the most"
    x = out[:, 0] * to_position(sim)
    room = OVER * (limits.high - limits.low)
    if x.min() < limits.low - room or x.max() > limits.high + room:
        return out, "a rival leaves the travel"
    return out, ""


def volts_of(sim: Simulator, push: np.ndarray) -> np.ndarray:
    """The correction (n,) as a command (n, drives)."""
    gain = sim.case.drive.amp_per_volt[0] if sim.record.plant == "ldu" else 1.0
    return push[:, None] * np.array(SHARE[sim.record.plant]) / gain


def weighed(problem: Problem, out: np.ndarray) -> np.ndarray:
    """Readings of the channels that count over their noise (rows, channels), averaged as a fit averages its errors."""
    e = out[:, problem.channels] / problem.sigma
    keep = len(e) // problem.mean * problem.mean
    return e[:keep].reshape(-1, problem.mean, e.shape[1]).mean(axis=1)


def moving(problem: Problem, y: np.ndarray) -> np.ndarray:
    """Rows (rows,) in which some sensor changes by a count. What is cut into counts says the same thing at rest, not
    something new at every tick, however long the rest."""
    lag = max(1, round(0.5 * STILL / (problem.sim.record.dt * problem.mean)))
    padded = np.pad(y, ((lag, lag), (0, 0)), mode="edge")
    change = np.abs(padded[2 * lag :] - padded[: -2 * lag]) * problem.sigma
    return (change > smallest_step(problem.sim)).any(axis=1)


def neighbours(model: Model) -> list[Model]:
    """The model with each number of its own terms moved a little."""
    out = []
    for i, term in enumerate(model.terms):
        for name in type(term).model_fields:
            value = getattr(term, name, None)
            if isinstance(value, float) and value != 0.0 and np.isfinite(value):
                moved = term.model_copy(update={name: value * (1.0 + STEP)})
                out.append(model._replace(terms=(*model.terms[:i], moved, *model.terms[i + 1 :])))
    return out


def distance(outcome: Outcome, i: int, j: int) -> float:
    """rms of what neither of the two can make up for by other values of its own terms, over the whole motion."""
    rows = outcome.moves[i] | outcome.moves[j]
    d = (outcome.readings[i] - outcome.readings[j])[rows].ravel()
    left = []
    for k in (i, j):
        e = beyond(d, [slope[rows].ravel() for slope in outcome.slopes[k]])
        left.append(np.sqrt(e @ e / outcome.readings[i].size))
    return float(min(left))


def beyond(d: np.ndarray, slopes: list[np.ndarray]) -> np.ndarray:
    """The part of d that is orthogonal to all slopes."""
    if not slopes or not len(d):
        return d
    A = np.stack(slopes, axis=1)
    A = A / np.maximum(np.linalg.norm(A, axis=0), 1e-12)
    found: np.ndarray = d - A @ np.linalg.lstsq(A.T @ A, A.T @ d, rcond=1e-8)[0]
    return found
