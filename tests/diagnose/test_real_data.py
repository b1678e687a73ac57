"""Recordings of real machines, which lie beside the project where they are there at all.

Source: Janot, Gautier & Brunot, Data set and reference models of EMPS (2019); Wigren & Schoukens, Three free data sets
for development and benchmarking in nonlinear system identification, ECC 2013.
"""

from functools import partial

import numpy as np
import pytest

from rtctl.diagnose import chain, heldout
from rtctl.diagnose.decide import complete
from rtctl.diagnose.diagnosis import AMBIGUOUS, NAMED
from rtctl.diagnose.fit import Problem
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.record import Record, load_record
from rtctl.diagnose.simulate import Simulator

BEST = 2.64e-3  # m, rmse of a free run of EMPS that others have published
AXIS = (
    "friction.coulomb", "friction.viscous", "friction.stribeck", "friction.asymmetry", "drive.offset", "load.spring",
)  # fmt: skip
OSCILLATOR = ("structure.stiffening", "load.spring", "friction.viscous", "friction.coulomb", "drive.gain_asymmetry")


def part(record: Record, n: int) -> Record:
    """The first n rows."""
    arrays = {name: getattr(record, name)[:n] for name in ("t", "ref", "w", "u")}
    return record._replace(y={k: v[:n] for k, v in record.y.items()},
                           columns={k: v[:n] for k, v in record.columns.items()}, **arrays)  # fmt: skip


@pytest.fixture(scope="module")
def emps(real_data):
    """EMPS with a few hypotheses: its record and what the search found on the first three quarters and predicts."""
    record = load_record(real_data / "emps")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chain, "hypotheses", partial(hypotheses, only=AXIS))
        sim = Simulator(record)
        problem = Problem(sim)
        return sim, problem, chain.find(sim, problem)


def test_a_ball_screw_of_which_only_the_mass_is_known_has_both_plain_frictions(emps):
    _, _, found = emps
    names = {h.name for h in found.best.space.hypotheses}
    assert {"friction.coulomb:carriage", "friction.viscous:carriage"} <= names
    terms = {t.term: t for t in found.best.model.terms}
    # the reference models of the data set give 203.5 N s/m and 20.4 N
    assert terms["friction.viscous"].B == pytest.approx(203.5, rel=0.25)
    assert terms["friction.coulomb"].F_C == pytest.approx(20.4, rel=0.25)


def test_its_free_run_on_rows_that_no_fit_saw_is_nearer_than_the_published_ones(emps):
    sim, problem, found = emps
    n = len(sim.record.t)
    cut = n - n // 4
    again = heldout.refit(sim, problem, found.best, cut)
    error = heldout.nrmse(sim, again.model, slice(cut, None)) * float(np.std(sim.seen))
    assert error < BEST


@pytest.fixture(scope="module")
def silverbox(real_data):
    record = part(load_record(real_data / "silverbox_multisine"), 10_000)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chain, "hypotheses", partial(hypotheses, only=OSCILLATOR))
        return chain.diagnose_record(record)


def test_the_spring_of_an_electronic_oscillator_stiffens(silverbox):
    assert silverbox.verdict in (NAMED, AMBIGUOUS)
    first = silverbox.effects[0]
    assert (first.name, first.node) == ("structure.stiffening", "carriage")
    assert first.parameters["c3"].low > 0.0
    assert silverbox.heldout_after < 0.2 * silverbox.heldout_before


def test_the_rivals_of_the_stiffening_spring_explain_less(silverbox):
    gains = {e.names: e.gain for e in silverbox.evidence if e.fitted}
    alone = gains[("structure.stiffening:carriage",)]
    assert all(alone > gain for names, gain in gains.items() if "structure.stiffening:carriage" not in names)
