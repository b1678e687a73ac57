"""Answer of a diagnosis: verdict, effects with sizes, location, held-out errors, untestable effects."""

import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from rtctl.diagnose.answer import words
from rtctl.diagnose.answer.experiment import Planned, left, planned
from rtctl.diagnose.answer.intervals import parameters, sizes
from rtctl.diagnose.answer.load import load
from rtctl.diagnose.calibration import SURE
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED, Effect, Interval, Located, LookAlike
from rtctl.diagnose.evidence.hollow import filled
from rtctl.diagnose.evidence.prediction import Heldout, predict
from rtctl.diagnose.evidence.predictive import freest
from rtctl.diagnose.evidence.verdict import Verdict, fewer, verdict
from rtctl.diagnose.evidence.withdrawn import borne_out, told
from rtctl.diagnose.likelihood.clock import UNSTEADY
from rtctl.diagnose.likelihood.fits import Fitted, refit
from rtctl.diagnose.likelihood.held import likelier, suits
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.likelihood.widths import half_widths
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.search.doubts import doubted
from rtctl.diagnose.search.search import Found, Progress, search
from rtctl.plants.physics import TERMS

SEEN = 5.0  # standard deviations: least signal of a typical size, beside the nominal parameters, of a testable effect
TOLD = 0.05  # probability from which on the headline reports a rival


class GraphDiagnosis(NamedTuple):
    """Diagnosis of recordings of a described machine."""

    record: GraphRecord  # of several recordings the one with the longest travel, which the figures show
    found: Found
    decided: Verdict
    effects: tuple[Effect, ...]
    located: Located | None
    parameters: dict[str, Interval]
    heldout: Heldout
    cannot_test: tuple[str, ...]
    predictor: Fitted  # the model with the best free run; its effects may be improbable in the verdict
    seconds: float
    records: tuple[GraphRecord, ...]
    planned: Planned = Planned()

    @property
    def experiment(self) -> dict[str, Any] | None:
        """Separating experiment as in diagnosis.json; None where there is none."""
        found = self.planned.experiment
        return None if found is None else found.as_dict()

    @property
    def nominal(self) -> dict[str, float]:
        """Nominal values by path and by symbol, values of one recording by path and recording, SI."""
        values, called = dict(self.found.base.space.owner.base), self.record.case.called
        return values | {called[path]: value for path, value in values.items() if path in called}

    @property
    def verdict(self) -> str:
        """Verdict: named, ambiguous, unnamed or nothing."""
        return self.decided.verdict

    @property
    def headline(self) -> str:
        """Verdict in one or two sentences."""
        machine, model = self.record.case.machine, self.decided.best.model
        if self.verdict == NOTHING:
            return "Nothing is missing that this recording can show: the description agrees with it down to the noise."
        number = self.decided.best.space.doubted
        if self.verdict == UNNAMED and number:
            return words.wrong_number(self.record, number, self.nominal[number], model.base[number])
        if self.verdict == UNNAMED:
            at = self.located
            where = f" at {words.here(machine, at.node)}, by {at.axis}" if at is not None else ""
            return f"Something is missing{where}, and no effect of the library explains it."
        sure = [words.clause(machine, e, model) for e in self.effects if e.confidence >= SURE]
        if self.verdict == NAMED:
            text = "; ".join(sure)
            return f"{text[:1].upper()}{text[1:]}."
        first = "; ".join(sure)
        text = f"{first[:1].upper()}{first[1:]}. Something else" if sure else "Something"
        return f"{text} is missing, most probably {self._open()}."

    def _open(self) -> str:
        """Uncertain effects of an ambiguous answer with their probability, and their alternatives, in words."""
        machine = self.record.case.machine
        open_ = [e for e in self.effects if e.confidence < SURE]
        names = " and ".join(words.called(machine, f"{e.name}:{e.node}") for e in open_)
        odds = min(e.confidence for e in open_)
        said = f"{names}{' together' if len(open_) > 1 else ''} ({100 * odds:.0f} %)"
        for e in open_:
            for other in e.look_alikes[:1]:
                if other.probability >= TOLD:
                    at = words.called(machine, f"{other.name}:{other.node}")
                    instead = f"instead of {words.called(machine, f'{e.name}:{e.node}')} " if len(open_) > 1 else ""
                    said += f"; {instead}it may be {at} ({100 * other.probability:.0f} %)"
        nameless = 1.0 - sum(p for _, p in self.decided.probabilities)
        number = self.decided.beside.space.doubted
        what = f"a wrong {number}" if number else "an effect without a name"
        return said + (f", or {what} ({100 * nameless:.0f} %)" if nameless >= TOLD else "")

    def as_json(self) -> dict[str, Any]:
        """Content of diagnosis.json in the exchange format."""
        return {
            "verdict": self.verdict,
            "headline": self.headline,
            "effects": [
                {
                    "name": e.name,
                    "node": e.node,
                    "confidence": round(e.confidence, 4),
                    "parameters": {k: v.as_json() for k, v in e.parameters.items()},
                    "look_alikes": [r._asdict() for r in e.look_alikes],
                    "check": TERMS[e.name].check,
                }
                for e in self.effects
            ],
            "located": None if self.located is None else self.located._asdict(),
            "why": self.decided.why,
            "parameters": {k: v.as_json() for k, v in self.parameters.items()},
            "fit": {
                "heldout_nrmse_before": self.heldout.before,
                "heldout_nrmse_after": self.heldout.after,
                "noise_floor": self.heldout.floor,
            },
            "probabilities": [
                {"effects": list(names), "probability": round(p, 4)}
                for names, p in self.decided.probabilities[:8]
                if p > 1e-4
            ],
            "cannot_test": list(self.cannot_test),
            "separating_experiment": self.experiment,
            "no_experiment": self.planned.untold,
            "recordings": [r.case.file.parent.name for r in self.records],
            "warnings": list(dict.fromkeys(line for r in self.records for line in r.case.warnings)),
            "seconds": round(self.seconds, 2),
        }


def diagnose(*folders: Path | str, progress: Progress = lambda _: None) -> GraphDiagnosis:
    """Diagnosis of a bundle of a described machine, or of several bundles of one machine together.

    Raises UserError for a bundle that cannot be read and NoAnswer for one that supports no verdict.
    """
    return diagnose_record(*map(load, folders), progress=progress)


def diagnose_record(*records: GraphRecord, progress: Progress = lambda _: None) -> GraphDiagnosis:
    """Diagnosis of records in memory, as by `diagnose`."""
    began = time.monotonic()
    with threadpool_limits(1):  # threads of linear algebra slow down small matrices
        like, space = together(records)
        if any(part.sim.record.edges for part in like.parts):  # a model under the observer decodes their directions
            progress("decoding the directions of edges")
            like = like.directed(refit(like, space).model)
        found = search(likelier(like, space), space, progress)
        other = suits(found.best)
        if other is not None:
            progress("changing the shape of the command between its samples")
            found = search(other, space, progress)
        progress("comparing named effects with wrong numbers and forces without a name")
        found = found._replace(doubts=doubted(found))
        decided = filled(verdict(found), found.base)
        progress("predicting the held-out rows")
        heldout, best = predict(found.base, decided.best, decided.verdict in (NAMED, AMBIGUOUS))
        decided = borne_out(fewer(decided, best, "the held-out rows are predicted better"), heldout)
        decided, heldout, numbers = told(decided, heldout, found)
        effects = _effects(decided, numbers)
        if len(left(decided)) > 1:
            progress("planning an experiment")
        return GraphDiagnosis(
            record=like.sim.record,
            found=found,
            decided=decided,
            effects=effects,
            located=_located(found, decided, effects),
            parameters=parameters(numbers, like.sim.record),
            predictor=freest(numbers) if decided.verdict in (NAMED, AMBIGUOUS) else numbers,
            heldout=heldout,
            planned=planned(like.sim.record, decided),
            cannot_test=tuple(sorted(_cannot(found))),
            seconds=time.monotonic() - began,
            records=tuple(part.sim.record for part in like.parts),
        )


def _effects(decided: Verdict, numbers: Fitted) -> tuple[Effect, ...]:
    """Effects of the verdict, with sizes from a model that has all of them."""
    if decided.verdict not in (NAMED, AMBIGUOUS):
        return ()
    best, spread = decided.best, half_widths(numbers)
    out = []
    for i, h in enumerate(best.space.hypotheses):
        looks = tuple(
            LookAlike(name.partition(":")[0], name.partition(":")[2], round(p, 4))
            for name, p in decided.rivals[i]
            if not name.startswith(f"{h.term}:")
        )
        out.append(
            Effect(
                h.term,
                h.node,
                min(decided.confidence[i], 0.99),
                sizes(numbers, numbers.names.index(h.name), spread),
                looks,
            )
        )
    ticks = decided.ticks
    if ticks is not None:
        name, node, parameter = UNSTEADY
        size = Interval(
            ticks.sigma, ticks.low, ticks.high, words.unit_at(best.like.sim.case.machine, name, node, parameter)
        )
        out.append(Effect(name, node, min(ticks.probability, 0.99), {parameter: size}, ()))
    if decided.verdict == AMBIGUOUS and len(best.names) == 1:
        others = [r for r in out[0].look_alikes if r.probability > (1.0 - SURE) / 2][:2]
        out += [Effect(r.name, r.node, r.probability, {}, (), f"{out[0].name}:{out[0].node}") for r in others]
    return tuple(out)


def _located(found: Found, decided: Verdict, effects: tuple[Effect, ...]) -> Located | None:
    if decided.verdict == NOTHING:
        return None
    base, best = found.base, decided.best
    scale = base.like.least
    c = int(np.argmax(np.sqrt(np.mean(base.e**2, axis=0)) / scale))
    channel = found.like.sim.channels[c]
    begin = found.like.rows[0] * found.like.sim.record.dt
    share = float(np.clip(1.0 - np.exp(min(best.loss - base.loss, 0.0) / base.like.size), 0.0, 1.0))
    if decided.verdict == UNNAMED:
        free = decided.unlisted
        if free is not None:
            return Located(channel, free.node, free.axis, f"along the {free.axis}", begin, share)
        if number := decided.beside.space.doubted:
            return Located(channel, number.split(".")[1], "time", f"in the number {number}", begin, share)
        return Located(channel, str(found.like.sim.body), "time", "over the whole recording", begin, share)
    axis = TERMS[effects[0].name].axis
    return Located(channel, effects[0].node, axis, f"along the {axis}", begin, share)


def _cannot(found: Found) -> list[str]:
    """Hypotheses whose typical size is not significant beside the nominal parameters."""
    norms: dict[str, float] = {}
    for score in found.scores:
        norms[score.hypothesis.name] = max(norms.get(score.hypothesis.name, 0.0), score.norm)
    return [name for name, norm in norms.items() if norm < SEEN]
