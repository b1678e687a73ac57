"""The whole diagnosis, stage by stage: preflight, base fit, hints, search, verdict, prediction, answer."""

import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from rtctl.config.errors import NoAnswer
from rtctl.diagnose import decide, heldout, locate
from rtctl.diagnose.base import base_fit
from rtctl.diagnose.diagnosis import AMBIGUOUS, NAMED, NOTHING, Diagnosis, Evidence, Interval
from rtctl.diagnose.experiment import design
from rtctl.diagnose.fit import Fit, Problem
from rtctl.diagnose.hints import hints
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.name import Search, eliminate, enrich, names, polish, rivals, search
from rtctl.diagnose.preflight import Preflight, preflight
from rtctl.diagnose.record import Record, load_record
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.space import Hypothesis
from rtctl.diagnose.uncertainty import covariance, parameter_intervals, parameter_unit
from rtctl.diagnose.verdict import Alternative, Verdict, judge

HELDOUT = 0.25  # share of a record, at its end, that the prediction is judged on
BLOCK = 1.0  # s, longer than any machine here remembers
NEAR = 3.0  # times the best cost: a rival this near is fitted to the bottom
Progress = Callable[[str], None]


class Found(NamedTuple):
    """What the search came to."""

    base: Fit
    best: Fit
    search: Search
    rivals: tuple[tuple[Alternative, ...], ...]  # for each hypothesis of the best, fits with another in its place


def quiet(text: str) -> None:
    """Say nothing."""


def diagnose(folder: Path | str, other: Path | str | None = None, progress: Progress = quiet) -> Diagnosis:
    """Diagnose the bundle in `folder`; `other` is a second recording of the same machine to predict.

    Raises UserError for a bundle that cannot be read and NoAnswer for one that supports no verdict.
    """
    record = load_record(folder)
    return diagnose_record(record, load_record(other) if other is not None else None, progress)


def diagnose_record(record: Record, other: Record | None = None, progress: Progress = quiet) -> Diagnosis:
    """As `diagnose`, for records in memory."""
    began = time.monotonic()
    with threadpool_limits(1):  # small matrices: threads of the linear algebra would only stand in each other's way
        progress("preflight")
        checked = preflight(record)
        sim = simulator(record)
        problem = Problem(sim)
        found = find(sim, problem, progress)
        block = max(2, round(BLOCK / (record.dt * problem.mean)))
        verdict = judge(problem, found.base, found.best, found.rivals, block)
        progress("predicting rows that were not fitted")
        return _answer(sim, other, problem, found, verdict, checked, block)._replace(seconds=time.monotonic() - began)


def simulator(record: Record) -> Simulator:
    """For a machine without a controller: of a command that was held and one that was sampled, the one that fits."""
    sim = Simulator(record)
    if record.case.controller.kind != "none":
        return sim
    smooth = Simulator(record, held=False)
    return min(sim, smooth, key=lambda s: base_fit(s, Problem(s)).cost)


def find(sim: Simulator, problem: Problem, progress: Progress = quiet) -> Found:
    """Base fit, search, and the rivals of what it found."""
    progress("fitting the owner's parameters")
    base = base_fit(sim, problem)
    error = sim.seen - sim.run(base.model)[:, 0]
    candidates = hypotheses(sim.record, base.model.base, hints(sim, base.model, error))
    worth = partial(decide.worth, problem)
    looked = search(problem, base, candidates, partial(decide.complete, problem), worth, progress)
    best = base
    for level in looked.rounds:
        if worth(best, level[0]):
            best = level[0]
    if len(best.space.hypotheses) > 1:
        best = polish(problem, eliminate(problem, best, worth))
    if not decide.complete(problem, best):
        best = enrich(problem, best, worth)
    near = replacements(problem, best, looked, candidates, progress)
    ahead = min((place.fit for places in near for place in places), key=lambda f: f.merit, default=best)
    if ahead.merit < best.merit:  # a rival came out ahead once it was fitted to the bottom
        best = ahead
        near = replacements(problem, best, looked, candidates, progress)
    return Found(base, best, looked, near)


def replacements(
    problem: Problem, best: Fit, looked: Search, candidates: Sequence[Hypothesis], progress: Progress
) -> tuple[tuple[Alternative, ...], ...]:
    """For each hypothesis of the best model, fits with another one in its place, nearest first."""
    out = []
    for h in best.space.hypotheses:
        progress(f"look-alikes of {h.name}")
        rest = set(names(best)) - {h.name}
        tried = [f for f in looked.fits if len(f.space.hypotheses) == len(rest) + 1 and rest < set(names(f))]
        if rest:
            tried += rivals(problem, best, best.space.hypotheses.index(h), candidates)
        nearest: dict[tuple[str, ...], Fit] = {}
        for f in sorted(tried, key=lambda f: f.merit):
            if names(f) != names(best):
                nearest.setdefault(names(f), f)
        fits = [polish(problem, f) if f.cost < NEAR * best.cost else f for f in list(nearest.values())[:5]]
        places = [Alternative(f, _other(f, rest)) for f in sorted(fits, key=lambda f: f.merit)]
        out.append(tuple(places))
    return tuple(out)


def _other(fitted: Fit, rest: set[str]) -> int:
    """Index of the hypothesis that is not among the rest."""
    return next(i for i, h in enumerate(fitted.space.hypotheses) if h.name not in rest)


def _answer(
    sim: Simulator,
    other: Record | None,
    problem: Problem,
    found: Found,
    verdict: Verdict,
    checked: Preflight,
    block: int,
) -> Diagnosis:
    """Prediction, intervals and all that the report needs."""
    record, base, best = sim.record, found.base, found.best
    taken = best if verdict.verdict in (NAMED, AMBIGUOUS) else base
    cut = len(record.t) - round(HELDOUT * len(record.t))
    if other is None:
        judge_sim, rows = sim, slice(cut, None)
        before, after = (heldout.refit(sim, problem, f, cut).model for f in (base, taken))
    else:
        judge_sim, rows = Simulator(other), slice(0, None)
        before, after = base.model, taken.model
    errors = [heldout.nrmse(judge_sim, model, rows) for model in (before, after)]
    floor = problem.floor * float(problem.sigma[0]) / (float(np.std(judge_sim.seen)) or 1.0)
    return Diagnosis(
        record=record,
        preflight=checked,
        verdict=verdict.verdict,
        effects=verdict.effects,
        located=None if verdict.verdict == NOTHING else locate.located(sim, problem, base, best, found.search),
        parameters=parameter_intervals(taken, covariance(taken, block)),
        owner=owner_model(record.case, record),
        before=base.model,
        after=taken.model,
        heldout_before=errors[0],
        heldout_after=errors[1],
        noise_floor=min(floor, errors[1]),
        evidence=evidence(problem, found),
        null_line=decide.MATERIAL,
        cannot_test=tuple(checked.cannot_test),
        hides=smallest(found) if verdict.verdict == NOTHING else {},
        experiment=_experiment(sim, found) if verdict.verdict == AMBIGUOUS else None,
        fit_rows=(problem.rows.start or 0, cut),
        seconds=0.0,
    )


def _experiment(sim: Simulator, found: Found) -> dict[str, Any] | None:
    """The experiment that tells the best model from its nearest rival; None where no motion within limits does."""
    places = sorted((place for places in found.rivals for place in places), key=lambda place: place.fit.merit)
    terms = {h.term for h in found.best.space.hypotheses}
    rival = next((place.fit for place in places if place.hypothesis.term not in terms), None)
    if rival is None:
        return None
    try:
        return design(sim.record, [found.best.model, rival.model], sim).as_dict()
    except NoAnswer:
        return None


def evidence(problem: Problem, found: Found) -> tuple[Evidence, ...]:
    """What each hypothesis and each fitted combination would explain."""
    out = [Evidence(names(f), decide.explained(problem, found.base, f), True) for f in found.search.fits]
    known = {e.names for e in out}
    excess = max(found.base.cost * (1 - (problem.floor / max(found.base.rms, 1e-12)) ** 2), 1e-12)
    for score in found.search.scores:
        key = (score.hypothesis.name,)
        if key not in known:
            known.add(key)
            out.append(Evidence(key, float(np.clip(score.gain / excess, 0.0, 1.0)), False))
    return tuple(sorted(out, key=lambda e: -e.gain))


def smallest(found: Found) -> dict[str, Interval]:
    """The smallest size of each hypothesis that would have been material, by its main parameter."""
    out: dict[str, Interval] = {}
    for score in found.search.scores:
        h = score.hypothesis
        if score.power <= 0.0 or not h.sizes:
            continue
        x = h.start()
        x[h.sizes[0]] = np.sqrt(2 * decide.MATERIAL * found.base.cost / score.power)
        c = h.coordinates[h.sizes[0]]
        name = c.name.partition("|")[0]
        value = abs(h.values(x)[name] - c.offset)
        if h.name not in out or value < out[h.name].value:
            out[h.name] = Interval(value, value, value, parameter_unit(found.base.model.kind, h, name))
    return out
