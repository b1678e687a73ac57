"""How rows that no fit saw are predicted: a free run, but for contacts that slip and let it run away."""

from types import SimpleNamespace

import pytest

from rtctl.diagnose import heldout
from rtctl.diagnose.kernel import CLOSED, TRACK
from rtctl.diagnose.predict import HELDOUT, cut_of, errors_of, slips

FREE = {"before": 0.01, "after": 12.0}
ON_TRACK = {"before": 0.005, "after": 0.0003}


def fitted(name, *terms):
    return SimpleNamespace(model=name, space=SimpleNamespace(hypotheses=[SimpleNamespace(term=t) for t in terms]))


@pytest.fixture
def judge(monkeypatch):
    seen = []

    def nrmse(sim, model, rows, edges, mode):
        seen.append((model, mode))
        return (ON_TRACK if mode == TRACK else FREE)[model]

    monkeypatch.setattr(heldout, "nrmse", nrmse)
    return SimpleNamespace(sim=None, edges=(), seen=seen)


def test_where_a_contact_slips_and_the_free_run_runs_away_the_model_is_kept_on_track(judge):
    old, new = fitted("before"), fitted("after", "friction.coulomb", "transmission.slip")
    assert errors_of(judge, old, new, slice(0, 9), CLOSED) == ([0.005, 0.0003], TRACK)


def test_any_other_model_that_runs_away_has_predicted_badly(judge):
    old, new = fitted("before"), fitted("after", "drive.supply_sag")
    assert errors_of(judge, old, new, slice(0, 9), CLOSED) == ([0.01, 12.0], CLOSED)


def test_one_that_slips_and_runs_well_is_asked_for_a_free_run(judge, monkeypatch):
    monkeypatch.setitem(FREE, "after", 0.002)
    old, new = fitted("before"), fitted("after", "transmission.slip")
    assert errors_of(judge, old, new, slice(0, 9), CLOSED) == ([0.01, 0.002], CLOSED)
    assert {mode for _, mode in judge.seen} == {CLOSED}


def test_where_the_track_is_all_there_is_it_is_asked_once(judge, monkeypatch):
    monkeypatch.setitem(ON_TRACK, "after", 1.0)
    errors, mode = errors_of(judge, fitted("before"), fitted("after", "transmission.slip"), slice(0, 9), TRACK)
    assert (errors, mode, len(judge.seen)) == ([0.005, 1.0], TRACK, 2)


def test_slip_is_seen_among_others():
    assert slips(fitted("after", "friction.coulomb", "transmission.slip"))
    assert not slips(fitted("before"))


def test_the_last_quarter_is_predicted():
    assert cut_of(SimpleNamespace(t=range(1000))) == 1000 - round(HELDOUT * 1000)
