"""Predicts rows that were not fitted with the model that was found: what of the verdict does that bear out?

Where the law is known the prediction is a free run, the loop closed. It tells nothing of terms where random forces act,
which it adds up, where it wanders though the model is right to the noise, of what hardly acts in these rows, and of a
contact that slips: whether that holds or lets the motor run away hangs on a hair. There the model is kept on track.
Where the machine goes on to places where it never was before, another quarter of the record may bear out one name.
"""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from rtctl.diagnose import decide, heldout
from rtctl.diagnose.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED, Effect
from rtctl.diagnose.find import Found
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.kernel import OPEN, TRACK
from rtctl.diagnose.model import Model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.record import Record
from rtctl.diagnose.simulate import SLIPS, Simulator
from rtctl.diagnose.verdict import (
    CLOSED,
    CLOSED_BY_SEVERAL,
    LOST,
    TELLING,
    Verdict,
    judged,
    label,
    only_testable,
    proven,
    with_known,
)

WORSE = 3.0  # times the error before: a free run this bad is judged as it is
OUTSIDE = 0.5  # of these rows: where the machine was never before, no law of the place can be judged
BOUNDED = 3.0  # times what noise and uncertainty make of a free run: a model beyond it does not predict
HELDOUT = 0.25  # share of a record, at its end, that the prediction is judged on


class Shown(NamedTuple):
    """A verdict, the models without and with what it names, and how well these predict."""

    verdict: Verdict
    refused: bool  # names that the fit gave and the prediction did not bear out
    taken: Fit
    before: Model
    before_error: float
    after_error: float
    floor: float
    on_track: bool  # whether the prediction was kept there, since its free run tells nothing
    untestable: tuple[str, ...]  # names that the prediction bore out and the record cannot test
    unpredicted: bool  # nothing was found, and the free run is further off than noise and uncertainty make it


def predicted(
    sim: Simulator,
    other: Record | None,
    found: Found,
    known: list[Effect],
    again: bool = False,
    cannot: Collection[str] = (),
) -> Shown:
    """The verdict on what was found, once its model has predicted rows that it was not fitted on: those of `other`, or
    the last of its own. `again` where more has been refused; `cannot` holds what the record cannot test."""
    problem, base, best = found.problem, found.base, found.best
    verdict = judged(problem, base, best, found.rivals, problem.block, cannot)
    if found.beyond is not None and verdict.verdict in (NAMED, AMBIGUOUS):
        verdict = Verdict(UNNAMED, (), verdict.explained)
    named = {e.name for e in with_known(verdict, known).effects}
    taken = best if any(h.term in named for h in best.space.hypotheses) else base
    cut = cut_of(sim.record)
    if other is None:
        judge, rows = problem, slice(cut, None)
        old, new = (heldout.refit(sim, problem, f, cut) for f in (base, taken))
    else:
        judge, rows, old, new = Problem(Simulator(other)).seen_by(taken.model), slice(0, None), base, taken
    usual = heldout.mode_of(judge.sim.record)
    errors, mode = errors_of(judge, old, new, rows, usual)
    floor = heldout.floor(judge)
    telling = TELLING * max(floor, heldout.uncertain(judge, new, rows, forces(problem, taken)) if mode == OPEN else 0.0)
    closed = (errors[0] - errors[1]) / (errors[0] - floor) if errors[0] > telling else np.nan
    # what is left of several that were refused has to do as much as they
    several = again or sum(e.instead_of is None for e in verdict.effects) > 1
    strict = mode == OPEN and np.isfinite(closed)
    if other is None and errors[1] < WORSE * errors[0] and not strict:
        closed, several = free_or_on_track(found, old, new, cut, closed, several)
    refusable = other is None and not several and closed < CLOSED and not strict
    if refusable and heldout.elsewhere(sim, np.arange(len(sim.seen)) >= cut) > OUTSIDE:
        closed, several = heldout.closed_within(problem, base, taken), True  # has to do as much as several
    if min(errors) >= LOST or (np.isnan(closed) and taken is not base):
        closed, several = heldout.repeated(problem.white or problem, base, taken), False
    loud = decide.loud(problem, base)
    proved = proven(verdict, closed, several, UNNAMED if loud else NOTHING)
    refused = bool(verdict.effects) and not proved.effects
    borne_out = with_known(proved, known)
    verdict = only_testable(borne_out, cannot)
    untestable = () if verdict.effects else tuple(e for e in map(label, borne_out.effects) if e in cannot)
    if not verdict.effects:
        taken, errors[1] = base, errors[0]
    unpredicted = verdict.verdict == NOTHING and not predicts(judge, old, rows, errors[0], usual, forces(problem, base))
    if unpredicted:
        verdict = verdict._replace(verdict=UNNAMED)
    return Shown(
        verdict, refused, taken, old.model, errors[0], errors[1], floor, mode != usual, untestable, unpredicted
    )


def forces(problem: Problem, fitted: Fit) -> bool:
    """Whether what the model leaves counts as random forces."""
    return problem.hiss(fitted.r)


def predicts(judge: Problem, fitted: Fit, rows: slice, error: float, mode: int, random: bool) -> bool:
    """Whether a free run of the model stays as near the record as noise, the uncertainty of its parameters and of its
    first state, and `random` forces let a right model be; `error` is its nrmse in `mode`.

    Under an unknown law the recorded command is the input of the free run.
    """
    if mode == TRACK:
        error = heldout.nrmse(judge.sim, fitted.model, rows, judge.edges, OPEN)
    limit = BOUNDED * max(heldout.uncertain(judge, fitted, rows, random), heldout.floor(judge))
    return bool(error <= limit)


def free_or_on_track(found: Found, old: Fit, new: Fit, cut: int, closed: float, several: bool) -> tuple[float, bool]:
    """What `new` closes of the gap beyond row `cut`, and whether it has to do as much as several names: as the free run
    has it, which `closed` this share, or as the errors on track do where the free run tells nothing."""
    problem, base, best = found.problem, found.base, found.best
    there = heldout.closed_on_track(problem, old, new, problem.time_rows >= cut)
    quiet = decide.quiet(problem, base, best)
    hiss = not quiet and problem.hiss(best.r)
    if problem.white is not None:
        return (1.0 if heldout.holds_in_white(problem.white, old, new, cut) else 0.0), several
    if hiss or heldout.early(problem, old, new, cut):
        # which random forces bring to no name
        return (closed, several) if closed > CLOSED_BY_SEVERAL else (there, several and not hiss)
    if quiet and (np.isnan(closed) or there > CLOSED_BY_SEVERAL):
        return there, several
    return closed, several


def errors_of(judge: Problem, old: Fit, new: Fit, rows: slice, mode: int) -> tuple[list[float], int]:
    """Held-out errors (nrmse) of the models without and with what was found, and how the prediction ran."""
    errors = [heldout.nrmse(judge.sim, f.model, rows, judge.edges, mode) for f in (old, new)]
    if mode != TRACK and slips(new) and errors[1] >= WORSE * errors[0]:
        return errors_of(judge, old, new, rows, TRACK)
    return errors, mode


def slips(fitted: Fit) -> bool:
    """Whether the model has a contact that slips."""
    return any(h.term == SLIPS for h in fitted.space.hypotheses)


def cut_of(record: Record) -> int:
    """First row of the part that is predicted and not fitted."""
    return len(record.t) - round(HELDOUT * len(record.t))
