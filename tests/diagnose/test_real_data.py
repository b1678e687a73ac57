"""Recordings of real machines, which lie beside the project where they are there at all.

Source: Janot, Gautier & Brunot, Data set and reference models of EMPS (2019); Wigren & Schoukens, Three free data sets
for development and benchmarking in nonlinear system identification, ECC 2013.
"""

from functools import partial

import numpy as np
import pytest

from rtctl.diagnose import chain, heldout
from rtctl.diagnose.fit import Problem
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.kernel import CLOSED, OPEN
from rtctl.diagnose.model import Model
from rtctl.diagnose.record import Record, load_record
from rtctl.diagnose.simulate import Simulator

BEST = 2.64e-3  # m, rmse of a free run of EMPS that others have published; theirs is open loop, on other rows
OPEN_LOOP = 4e-3  # m, of ours, where errors add up for 25 s
AXIS = (
    "friction.coulomb", "friction.viscous", "friction.asymmetry", "drive.offset", "drive.gain_asymmetry", "load.spring",
)  # fmt: skip
OSCILLATOR = (
    "structure.stiffening", "load.spring", "friction.viscous", "drive.gain_asymmetry", "drive.offset",
)  # fmt: skip


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
    assert terms["friction.viscous"].B == pytest.approx(203.5, rel=0.1)
    assert terms["friction.coulomb"].F_C == pytest.approx(20.4, rel=0.1)
    assert found.best.model.base["M"] == pytest.approx(95.1, rel=0.05)


def test_something_is_one_sided_too(emps):
    """An offset of the drive or friction with a direction: the reference models have it as an offset."""
    _, _, found = emps
    assert {h.term for h in found.best.space.hypotheses} & {"drive.offset", "friction.asymmetry"}


def rmse(sim: Simulator, model: Model, mode: int, rows: slice) -> float:
    """Of the free run's position, m."""
    return float(np.sqrt(np.mean((sim.run(model, mode)[:, 0] - sim.seen)[rows] ** 2)))


def test_its_free_run_on_rows_that_no_fit_saw_closes_the_loop_and_hardly_errs(emps):
    sim, problem, found = emps
    cut = len(sim.seen) - len(sim.seen) // 4
    base, best = (heldout.refit(sim, problem, f, cut).model for f in (found.base, found.best))
    error = rmse(sim, best, CLOSED, slice(cut, None))
    assert error < BEST
    assert error < 0.1 * rmse(sim, base, CLOSED, slice(cut, None))
    nrmse = heldout.nrmse(sim, best, slice(cut, None))
    assert nrmse * float(np.std(sim.seen)) == pytest.approx(error, rel=1e-9)


def test_under_the_recorded_command_alone_it_does_not_drift_far_in_25_s(emps):
    """For that, what counts is how the model does over seconds: it is fitted with a slow correction."""
    sim, _, found = emps
    cut = len(sim.seen) - len(sim.seen) // 4
    slow = Simulator(sim.record, follow=1.0)
    model = heldout.refit(slow, Problem(slow), found.best, cut).model
    assert rmse(sim, model, OPEN, slice(cut, None)) < OPEN_LOOP


@pytest.fixture(scope="module")
def silverbox(real_data):
    record = part(load_record(real_data / "silverbox_multisine"), 10_000)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chain, "hypotheses", partial(hypotheses, only=OSCILLATOR))
        return chain.diagnose_record(record)


def test_the_stiffening_spring_of_an_oscillator_beats_its_rivals(silverbox):
    spring = "structure.stiffening:carriage"
    gains = {e.names: e.gain for e in silverbox.evidence if e.fitted}
    alone = gains[(spring,)]
    assert alone > 1.5 * max(gain for names, gain in gains.items() if len(names) == 1 and names != (spring,))
    assert all(alone > gain for names, gain in gains.items() if spring not in names)
    assert spring in max(gains, key=lambda names: gains[names])


def test_it_is_named(silverbox):
    assert silverbox.verdict in ("named", "ambiguous")
    first = next(e for e in silverbox.effects if e.name == "structure.stiffening")
    assert first.parameters["c3"].low > 0.0
    assert silverbox.heldout_after < 0.2 * silverbox.heldout_before
