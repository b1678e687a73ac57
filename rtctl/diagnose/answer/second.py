"""Held-out prediction of a second recording of a machine by the models fitted to the first."""

from pathlib import Path

from threadpoolctl import threadpool_limits

from rtctl.config.errors import UserError
from rtctl.diagnose.answer.answer import GraphDiagnosis
from rtctl.diagnose.answer.load import load
from rtctl.diagnose.evidence.prediction import judged
from rtctl.diagnose.likelihood.joint import check_same
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.model.simulate import Simulator


def predicted(d: GraphDiagnosis, other: Path | str) -> GraphDiagnosis:
    """Diagnosis with the errors on the recording in the folder `other` as held-out errors.

    Raises UserError where the folder cannot be read or is of another machine, NoAnswer where it supports no verdict.
    """
    sim = Simulator(load(other))
    if len(d.found.like.parts) > 1:
        raise UserError("--heldout needs one recording; leave it out: of several recordings the last part is held out")
    if sim.record.edges:
        sim = sim.directed(d.decided.best.model)
    check_same(d.record, sim.record)
    like = Likelihood(sim)
    with threadpool_limits(1):
        return d._replace(heldout=judged(like, like, like, (d.found.base, d.decided.best)))
