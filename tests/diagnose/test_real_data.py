"""Recordings of real machines, which lie beside the project where they are there at all.

Source: Janot, Gautier & Brunot, Data set and reference models of EMPS (2019); Wigren & Schoukens, Three free data sets
for development and benchmarking in nonlinear system identification, ECC 2013; github.com/gchenfc/ODrive,
analysis/cogging_torque, for the brushless motor.
"""

from functools import partial

import numpy as np
import pytest

from rtctl.diagnose import chain, heldout
from rtctl.diagnose import find as finding
from rtctl.diagnose.base import base_fit
from rtctl.diagnose.fit import Fit, fit
from rtctl.diagnose.forms import richer
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.kernel import CLOSED, OPEN
from rtctl.diagnose.measure import compare
from rtctl.diagnose.model import Model, owner_model
from rtctl.diagnose.preflight import preflight
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.record import Record, load_record
from rtctl.diagnose.rest import upto
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.turn import over_turn

BEST = 2.64e-3  # m, rmse of a free run of EMPS under its command that others have published, of another recording
SILVERBOX = 0.301e-3  # V, the same of the Silverbox
AXIS = (
    "friction.coulomb", "friction.viscous", "friction.asymmetry", "drive.offset", "drive.gain_asymmetry", "load.spring",
)  # fmt: skip
OSCILLATOR = (
    "structure.stiffening", "load.spring", "friction.viscous", "drive.gain_asymmetry", "drive.offset",
)  # fmt: skip


def part(record: Record, rows: slice) -> Record:
    """Some of its rows."""
    arrays = {name: getattr(record, name)[rows] for name in ("t", "ref", "w", "u")}
    return record._replace(y={k: v[rows] for k, v in record.y.items()},
                           columns={k: v[rows] for k, v in record.columns.items()}, **arrays)  # fmt: skip


def fitted(sim: Simulator, *terms: str, rich: tuple[str, ...] = ()) -> Fit:
    """The owner's model with these terms, those in `rich` in their richer form, fitted on track."""
    problem = Problem(sim)
    base = base_fit(sim, problem)
    found = {h.term: h for h in hypotheses(sim.record, base.model.base, only=terms)}
    more = {name: richer(sim.record, base.model.base, h) if name in rich else h for name, h in found.items()}
    return fit(problem, base.space.add(*(more[name] for name in terms)), rounds=40, enough=1e-4)


def free(record: Record, model: Model) -> float:
    """Rmse of the run under the recorded command, from the record's own beginning on, as `rtctl simulate` tells it."""
    return compare(record, model, OPEN, skip=50).channels["x"].rmse


@pytest.fixture(scope="module")
def emps(real_data):
    """EMPS with a few hypotheses: its record and what the search found on the first three quarters and predicts."""
    record = load_record(real_data / "emps")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(finding, "hypotheses", partial(hypotheses, only=AXIS))
        sim = Simulator(record)
        problem = Problem(sim)
        return sim, problem, finding.find(sim, problem)


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


PLAIN = ("friction.coulomb", "friction.viscous", "drive.offset")
TILTED = ("friction.coulomb", "friction.viscous", "friction.asymmetry")


def test_its_viscous_friction_has_a_direction(emps):
    """Which explains the track four times as well as an offset, and has nothing left over for one."""
    sim, _, _ = emps
    plain, tilted = fitted(sim, *PLAIN), fitted(sim, *TILTED, rich=("friction.asymmetry",))
    assert tilted.cost < 0.3 * plain.cost
    term = next(t for t in tilted.model.terms if t.term == "friction.asymmetry")
    assert term.B_a == pytest.approx(-37.0, rel=0.1)
    assert abs(term.a) < 0.03


@pytest.mark.parametrize("share", [0.75, 1.0])
def test_under_the_recorded_command_alone_it_stays_within_what_others_reach(emps, share):
    """Fitted on three quarters and run on the last from its own beginning; fitted on all and run on all, 25 s."""
    record = emps[0].record
    cut = round(share * len(record.t))
    sim = Simulator(part(record, slice(0, cut)))
    model = heldout.free_fit(sim, fitted(sim, *TILTED, rich=("friction.asymmetry",))).model
    assert free(part(record, slice(cut if share < 1.0 else 0, None)), model) < BEST


def test_a_fit_that_is_asked_for_the_free_run_drifts_less(emps):
    sim, _, _ = emps
    on_track = fitted(sim, *PLAIN)
    moved = heldout.free_fit(sim, on_track)
    assert free(sim.record, moved.model) < 0.8 * free(sim.record, on_track.model)
    assert rmse(sim, moved.model, CLOSED, slice(1000, None)) < 1.2 * rmse(
        sim, on_track.model, CLOSED, slice(1000, None)
    )


@pytest.fixture(scope="module")
def silverbox(real_data):
    record = part(load_record(real_data / "silverbox_multisine"), slice(0, 10_000))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(finding, "hypotheses", partial(hypotheses, only=OSCILLATOR))
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


def test_with_a_lopsided_spring_that_loses_more_as_it_bends_it_runs_as_freely_as_the_best(real_data):
    """Fitted on a seventh of the record, run on another."""
    record = load_record(real_data / "silverbox_multisine")
    sim = Simulator(part(record, slice(0, 10_000)), held=False)
    found = fitted(sim, "structure.stiffening", "drive.offset", rich=("structure.stiffening",))
    model = heldout.free_fit(sim, found).model
    spring = model.terms[0]
    assert (spring.c3, spring.b2) == (pytest.approx(3.95, rel=0.03), pytest.approx(6e-4, rel=0.3))
    assert free(part(record, slice(50_000, 60_000)), model) < SILVERBOX


@pytest.fixture(scope="module")
def motors(real_data):
    return [load_record(real_data / f"bldc_slow_{k}") for k in range(3)]


def test_a_clock_that_is_uneven_is_laid_out_and_said(motors):
    for record in motors:
        assert np.ptp(np.diff(record.t)) < 1e-9
        assert any("uneven" in finding for finding in preflight(record).findings)
        assert any("laid onto" in finding for finding in preflight(record).findings)


def test_three_recordings_of_a_motor_give_one_torque_over_the_turn(motors):
    turns = [over_turn(record, owner_model(record.case, record)) for record in motors]
    for found in turns:
        assert found.orders[0].order == 7.0
        assert found.orders[0].amplitude == pytest.approx(6.8e-3, rel=0.05)
        assert found.orders[0].share > 0.7
    known = np.logical_and.reduce([np.isfinite(found.torque) for found in turns])
    assert known.mean() > 0.85
    for one, two in ((0, 1), (0, 2), (1, 2)):
        off = (turns[one].torque - turns[two].torque)[known]
        assert np.std(off) < 0.05 * np.std(turns[one].torque[known])


def test_what_keeps_one_speed_only_is_given_no_wrong_name(motors):
    """The controller answers the torque with the command: a drive that did nothing would look alike."""
    found = chain.diagnose_record(upto(motors[0], len(motors[0].t) // 4))
    assert {e.name for e in found.effects} <= {"ripple.cogging", "friction.coulomb", "friction.viscous"}
