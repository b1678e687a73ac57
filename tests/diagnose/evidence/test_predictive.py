import numpy as np
import pytest
from graph_cases import named, nothing, unnamed

from rtctl.diagnose.evidence.predictive import at, free_error, freest, least_squares, predictive, probable


def total_dry_friction(f, x):
    """Total dry friction of the carriage (N): description plus effect; a recording shows only the sum."""
    model = f.space.model(x)
    return model.base["bodies.carriage.dry"] + model.terms[-1].F_C


def test_least_squares_recovers_the_recorded_friction():
    best = named().found.best
    size = best.space.columns(0)[0]
    x = best.x.copy()
    x[size] *= 1.3
    assert total_dry_friction(best, x) > 1.1 * total_dry_friction(best, best.x)
    assert total_dry_friction(best, least_squares(best.like, best._replace(x=x))) == pytest.approx(4.0, rel=0.1)


def test_true_model_has_the_smaller_free_run_error():
    d = named()
    base, best = (f.model for f in d.heldout.fits)
    assert free_error(d.heldout.late, best) < 0.3 * free_error(d.heldout.late, base)


def test_parameters_with_the_smallest_free_run_error_are_chosen():
    best = named().found.best
    x = best.x.copy()
    x[best.space.columns(0)[0]] *= 1.3
    off = at(best, x)
    found = freest(off)
    assert found.names == best.names
    assert free_error(off.like, found.model) < 0.5 * free_error(off.like, off.model)
    assert free_error(off.like, freest(best).model) <= free_error(off.like, best.model)


def test_divergent_model_has_an_infinite_free_run_error():
    d = named()
    base = d.found.base.model
    lost = base._replace(base=base.base | {"joints.belt.damping": -1e6})
    assert free_error(d.heldout.late, lost) == np.inf


def test_predictor_has_all_effects_of_the_verdict():
    d = named()
    assert set(d.decided.best.names) <= set(d.predictor.names)
    assert {e.name + ":" + e.node for e in d.effects} <= set(d.predictor.names)


@pytest.mark.parametrize("d", [nothing(), unnamed()])
def test_verdict_without_a_name_keeps_the_best_model(d):
    assert d.predictor is d.decided.best
    assert predictive(d.decided, d.heldout) is d.decided.best


def test_probable_models_are_those_with_more_effects_and_enough_posterior():
    decided = named().decided
    best = decided.best
    more = best._replace(space=best.space.add(best.space.hypotheses[0]._replace(node="motor")))
    table = (*decided.table, decided.table[0]._replace(fit=more))
    likely = ((best.names, 0.6), (more.names, 0.4))
    assert probable(decided._replace(table=table, probabilities=likely)) == [more]
    assert probable(decided._replace(table=table, probabilities=((best.names, 0.95), (more.names, 0.05)))) == []
