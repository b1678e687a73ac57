"""Prediction of a second recording of the same machine by the models that were fitted to the first."""

from pathlib import Path

from threadpoolctl import threadpool_limits

from rtctl.config.errors import UserError
from rtctl.diagnose.graph.answer import GraphDiagnosis, load
from rtctl.diagnose.graph.likelihood import Likelihood
from rtctl.diagnose.graph.prediction import judged
from rtctl.diagnose.graph.record import GraphRecord
from rtctl.diagnose.graph.simulate import Simulator


def predicted(d: GraphDiagnosis, other: Path | str) -> GraphDiagnosis:
    """The diagnosis with the errors on the recording in the folder `other` as its held-out errors.

    Raises UserError where the folder cannot be read or is of another machine, NoAnswer where it supports no verdict.
    """
    sim = Simulator(load(other))
    if sim.record.edges:
        sim = sim.directed(d.decided.best.model)
    check_same(d.record, sim.record)
    like = Likelihood(sim)
    with threadpool_limits(1):
        return d._replace(heldout=judged(like, like, (d.found.base.model, d.decided.best.model), like.rows))


def check_same(first: GraphRecord, second: GraphRecord) -> None:
    """Raise UserError where two records are of machines with other elements."""
    for group in ("bodies", "joints", "drives", "sensors"):
        one, two = (set(getattr(r.case.machine, group)) for r in (first, second))
        if one != two:
            raise UserError(
                f"{second.case.file}: machine.{group} has {', '.join(sorted(two)) or 'none'}, and the first recording "
                f"has {', '.join(sorted(one)) or 'none'}; a second recording is of the same machine"
            )
    if list(first.y) != list(second.y):
        raise UserError(
            f"{second.case.file}: the recording shows {', '.join(second.y)}, and the first {', '.join(first.y)}; "
            "a second recording has the same sensors"
        )
