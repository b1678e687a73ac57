"""The whole diagnosis, stage by stage: preflight, base fit, hints, search, verdict, prediction, answer."""

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from rtctl.config.errors import NoAnswer
from rtctl.diagnose import decide, heldout, locate, solver
from rtctl.diagnose.base import base_fit
from rtctl.diagnose.diagnosis import AMBIGUOUS, NOTHING, UNNAMED, Diagnosis, Evidence, Interval, Located
from rtctl.diagnose.experiment import design
from rtctl.diagnose.find import Found, Progress, find, quiet, with_fewer
from rtctl.diagnose.fit import Fit, fit
from rtctl.diagnose.jitter import Jitter
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.name import names
from rtctl.diagnose.predict import Shown, cut_of, predicted, slips
from rtctl.diagnose.preflight import Preflight, preflight
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.record import Record, load_record
from rtctl.diagnose.rest import telling
from rtctl.diagnose.rework import drop
from rtctl.diagnose.shrink import shrunk
from rtctl.diagnose.simulate import BEHIND, SLIPS, Simulator
from rtctl.diagnose.stretches import rms
from rtctl.diagnose.uncertainty import covariance, parameter_intervals, parameter_unit
from rtctl.diagnose.verdict import of_jitter
from rtctl.plants.physics import TERMS
from rtctl.plants.physics.timing import JitterSettings

QUICK = 10 / 3  # times the usual bandwidth of the correction
FASTEST = 0.1  # rad a tick
OTHERWISE, AS_WELL = 0.9, 1.05  # of the cost
ASTRAY = 5.0  # times the noise of a reel's edges, where no model explains them
SHOWS = 2.5  # times the noise floor
HELD = 0.3  # of the share of the cost that a term takes off, which it must take off however the model is kept on track


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
        record, left_out = telling(record)
        checked = preflight(record)
        found = searched(record, progress)
        problem, sim = found.problem, found.problem.sim
        solved = solver.finding(problem, found.best.model)
        checked = replace(checked, findings=(*checked.findings, solved, *left_out))
        progress("predicting rows that were not fitted")
        known = [of_jitter(found.jitter)] if found.jitter is not None else []
        shown = predicted(sim, other, found, known, cannot=checked.cannot_test)
        while shown.refused and len(found.best.space.hypotheses) > 1:  # several that only imitate: one may be there
            found = with_fewer(found)
            shown = predicted(sim, other, found, known, again=True, cannot=checked.cannot_test)
        return _answer(sim, found, shown, checked)._replace(seconds=time.monotonic() - began)


def searched(record: Record, progress: Progress) -> Found:
    """What is found in a recording, at the bandwidth that suits it.

    For an axis under control that no model explains down to the noise: a quicker correction, which lets less of the
    slow wandering through that random forces make and that a small difference between two hypotheses drowns in; but
    only if what is missing still shows, or if no hypothesis explained any of the wandering and what is left without it
    is hiss.
    """
    progress("fitting the nominal parameters")
    if record.plant == "axis" and record.case.controller.kind == "none":
        return held_or_smooth(record, progress)
    problem, base = base_of(Simulator(record))
    sim = problem.sim
    found = find(sim, problem, progress, base, sound)
    if not found.problem.agrees(found.best.model):
        progress("reading the reels anew, through the model that was found")
        found = read_through(sim, found, progress)
    if misread(found):
        found = without_reels(sim, found, progress)
    if slip_is_imagined(found.problem, found.best):
        progress("correcting every model as one that slips")
        found = without_slip(found, progress)
    if record.plant in BEHIND:
        found = borne_out(found)
    faster = min(QUICK * sim.follow, FASTEST / record.dt)
    if record.plant != "axis" or faster <= sim.follow:
        return found
    problem, base = found.problem, found.base
    if base.rms < decide.LOUD * problem.floor or decide.quiet(problem, base, found.best):
        return found
    quick, fitted = base_of(Simulator(record, follow=faster))
    if not tells(found, quick, fitted):
        return found
    again = find(quick.sim, quick, progress, fitted)
    return found if stays(found, again) else again


def held_or_smooth(record: Record, progress: Progress) -> Found:
    """What is found where nobody wrote down what the command did between its samples: held or sampled from a smooth
    one, whichever the owner's model fits, and the other one where what was found follows that clearly better."""
    both = [base_of(Simulator(record, held=held)) for held in (True, False)]
    (problem, base), (other, instead) = sorted(both, key=lambda pair: pair[1].cost)
    found = find(problem.sim, problem, progress, base)
    if not suits(other, found.best):
        return found
    progress("taking the command the other way between its samples")
    return find(other.sim, other, progress, instead)


def suits(other: Problem, best: Fit) -> bool:
    """Whether the `best` model of a problem follows the record clearly better in the `other` one, or as well without a
    lag or delay that made up for half a tick."""
    if not best.space.hypotheses:
        return False
    space, x, limit = best.space, best.x, OTHERWISE
    for index in reversed(range(len(best.space.hypotheses))):
        if TERMS[best.space.hypotheses[index].term].late:
            x, space, limit = drop(best._replace(space=space, x=x), index), space.without(index), AS_WELL
    return fit(other, space, x, rounds=8).cost < limit * best.cost


def tells(found: Found, quick: Problem, fitted: Fit) -> bool:
    """Whether the base, `fitted` under a quicker correction, is to be asked in place of what was `found`."""
    if fitted.rms >= SHOWS * quick.floor:  # what is missing still shows
        return True
    return not found.best.space.hypotheses and quick.hiss(fitted.r)  # all the rest was wandering


def stays(found: Found, again: Found) -> bool:
    """Whether what was `found` has the say, and not what was found `again` under another correction: where that may not
    be told, and this may and follows the record better, seen under that one, or all there was is hiss."""
    if decide.enough(again.problem, again.base, again.best):
        return False
    if not found.best.space.hypotheses:
        return found.problem.hiss(found.base.r)
    if not decide.enough(found.problem, found.base, found.best):
        return False
    return fit(again.problem, found.best.space, found.best.x, rounds=10).merit < again.best.merit


def read_through(sim: Simulator, found: Found, progress: Progress) -> Found:
    """What is found once the reels are read through the model that was `found`."""
    problem = Problem(sim).seen_by(found.best.model)
    return find(sim, problem, progress, base_fit(sim, problem, found.base.x))


def without_reels(sim: Simulator, found: Found, progress: Progress) -> Found:
    """What the capstan shows alone, where no model follows the reels; if something is missing there, what all show once
    the reels are read through that, and `found` if no model follows them even so."""
    progress("leaving out the reels, which no model follows")
    bare = Problem(sim)
    alone = base_fit(sim, bare)
    apart = find(sim, bare, progress, alone)
    if decide.quiet(bare, alone, alone):
        return apart
    if not apart.best.space.hypotheses:
        return found
    progress("reading the reels anew, through what the capstan shows")
    again = read_through(sim, apart, progress)
    return found if misread(again) else again


def misread(found: Found) -> bool:
    """Whether the reels are further from every model than their edges could be: then some were taken for others."""
    best, problem = found.best, found.problem
    reels = list(problem.by_sensor(best.r).values())[len(problem.channels) :]
    return any(rms(e) > ASTRAY for e in reels) and not decide.enough(problem, found.base, best)


def sound(problem: Problem, best: Fit) -> bool:
    """Whether a model agrees with how the reels were read, and its contact, where it slips, does what no push does."""
    return problem.agrees(best.model) and not slip_is_imagined(problem, best)


def slip_is_imagined(problem: Problem, best: Fit) -> bool:
    """Whether that the model is corrected as one that slips brings what the slip seems to."""
    if not slips(best):
        return False
    alike = problem.pushed_behind()
    index = next(i for i, h in enumerate(best.space.hypotheses) if h.term == SLIPS)
    less = fit(alike, best.space.without(index), drop(best, index), rounds=12)
    base = base_fit(alike.sim, alike, best.x[: best.space.nb])
    return not decide.worth(alike, base, less, best)


def without_slip(found: Found, progress: Progress) -> Found:
    """What is found where every model is corrected as one that slips; no name, where the push takes up all there is."""
    alike = found.problem.pushed_behind()
    apart = find(alike.sim, alike, progress)
    return apart if apart.best.space.hypotheses else found.bare()


def borne_out(found: Found) -> Found:
    """`found` without what does far less where every model is kept on track by a push behind the contact: what a
    machine does is there however its model is led, what a correction misses is not."""
    problem, best = found.problem, found.best
    if problem.sim.behind or slips(best) or not best.space.hypotheses:  # of a slip `sound` has the say
        return found
    alike = problem.pushed_behind()
    gains = []
    for which, start in ((problem, best), (alike, fit(alike, best.space, best.x, rounds=10))):
        rest = [fit(which, best.space.without(i), drop(start, i), rounds=10) for i in range(len(best.space.hypotheses))]
        gains.append([1.0 - start.cost / less.cost for less in rest])
    missing = [i for i, (own, other) in enumerate(zip(*gains, strict=True)) if other < HELD * own]
    return borne_out(with_fewer(found, missing[0])) if missing else found


def base_of(sim: Simulator) -> tuple[Problem, Fit]:
    """Its problem, and the fit of the owner's parameters, which shows which way counters without direction went."""
    problem = Problem(sim)
    base = base_fit(sim, problem)
    directed = problem.seen_by(base.model)
    return (directed, base_fit(sim, directed, base.x)) if directed.edges else (problem, base)


def _answer(sim: Simulator, found: Found, shown: Shown, checked: Preflight) -> Diagnosis:
    """Intervals and all that the report needs."""
    record, problem, base, taken, verdict = sim.record, found.problem, found.base, shown.taken, shown.verdict
    sure = shrunk(problem, taken)
    runs = heldout.free_fit(sim, sure.fitted).model
    return Diagnosis(
        record=record,
        preflight=checked,
        verdict=verdict.verdict,
        effects=verdict.effects,
        located=None if verdict.verdict == NOTHING else _located(sim, found, verdict.verdict != UNNAMED),
        parameters=parameter_intervals(taken, covariance(taken, problem.block)),
        owner=owner_model(record.case, record),
        before=base.model,
        after=runs if found.jitter is None else runs.add(ticks(found.jitter, record.dt)),
        heldout_before=shown.before_error,
        heldout_after=shown.after_error,
        noise_floor=min(shown.floor, shown.after_error),
        evidence=evidence(problem, found),
        null_line=decide.MATERIAL,
        cannot_test=tuple(checked.cannot_test),
        hides=smallest(found) if verdict.verdict == NOTHING else {},
        experiment=_experiment(sim, found) if verdict.verdict == AMBIGUOUS else None,
        left_out=sure.reasons,
        fit_rows=(problem.rows.start or 0, cut_of(record)),
        seconds=0.0,
        on_track=shown.on_track,
        untestable=shown.untestable,
        unpredicted=shown.unpredicted,
        random_forces=not decide.quiet(problem, base, taken) and problem.hiss(taken.r),
        faint=problem.white is not None and bool(shown.verdict.effects),
        resembles=resembled(found) if verdict.verdict == UNNAMED else None,
    )


def _located(sim: Simulator, found: Found, named: bool) -> Located:
    """Where the error of the fitted base lives."""
    ticks = found.jitter is not None
    return locate.located(sim, found.problem, found.base, found.best, found.search, named, ticks)


def resembled(found: Found) -> tuple[str, str] | None:
    """The law without a name that does better than what was found, and its node."""
    terms = () if found.beyond is None else found.beyond.space.hypotheses
    return next(((h.term, h.node) for h in terms if not TERMS[h.term].tabled), None)


def ticks(found: Jitter, dt: float) -> JitterSettings:
    """The entry of a `physics:` list for it."""
    return JitterSettings(node="loop", sigma=min(found.sigma, 0.01), rate=1.0 / dt)


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
            out[h.name] = Interval(value, value, value, parameter_unit(found.base.model, h, name))
    return out
