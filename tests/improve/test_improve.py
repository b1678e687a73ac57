"""Remedies on the emulated machine: a correct model reduces the error, a wrong model does not increase it."""

import numpy as np
import pytest

from rtctl.config.errors import NoAnswer
from rtctl.config.load import set_paths
from rtctl.improve import found, played
from rtctl.improve.improve import acceleration, improve, travel


def improved(config):
    return improve(found.of_config(config, "a test"), written_too=False)


def rms_errors_on(truth, r):
    """RMS errors on the machine `truth`, without and with the improvement."""
    without = played.play(r.without, truth, r.before.t[-1] + 1e-3, r.judge)
    with_it = played.play(r.trial, truth, r.before.t[-1] + 1e-3, r.judge, without.ref)
    return without.figures.rms, with_it.figures.rms


@pytest.fixture(scope="module")
def right(with_sizes):
    return improved(with_sizes(dry=3.0, dead_band=0.3))


def test_found_effects_are_compensated(right):
    kept = {one.remedy.kind for one in right.tried if one.kept}
    assert {"description", "feedforward", "curve"} <= kept
    assert right.reduction > 0.8
    assert right.after.figures.final < 0.2 * right.before.figures.final


def test_improved_law_keeps_the_stability_margins(right):
    assert right.margins_after.GM >= 6.0 and right.margins_after.PM >= 45.0


def test_rejected_remedies_give_a_reason(right):
    left = [one for one in right.tried if not one.kept]
    assert left and all(one.reason for one in left)
    spring = next(one for one in left if "load.spring" in one.remedy.against)
    assert "does not fall" in spring.reason  # of size 0


@pytest.mark.parametrize("wrong", [{"spring": 30.0}, {"dead_band": 0.6}])
def test_remedy_for_a_wrong_effect_does_not_increase_the_error(wrong, with_sizes):
    r = improved(with_sizes(**wrong))
    without, with_it = rms_errors_on(with_sizes(dry=3.0), r)
    assert with_it < 1.05 * without


def test_improved_law_reduces_the_error_of_a_machine_with_other_effect_sizes(with_sizes, right):
    without, with_it = rms_errors_on(with_sizes(dry=3.4, dead_band=0.26), right)
    assert with_it < 0.4 * without


def test_improvement_is_deterministic(with_sizes, right):
    again = improved(with_sizes(dry=3.0, dead_band=0.3))
    assert again.after.figures == right.after.figures
    assert np.array_equal(again.after.y, right.after.y)


def test_machine_that_trips_with_the_present_law_has_no_answer(with_sizes):
    config = set_paths(with_sizes(), {"safety.following_error": 0.01})
    with pytest.raises(NoAnswer, match=r"trips with the law that it has .*rtctl tune"):
        improved(config)


def test_acceleration_per_volt_includes_all_moving_inertia(with_sizes):
    config = with_sizes()
    J = 0.21e-4 + 1.4 * 12.7e-3**2
    assert acceleration(config) == pytest.approx((0.03 / J, 0.03 / J))
    assert travel(config) == (0.0, 12.0)


def test_speed_loop_has_no_acceleration_feedforward(with_sizes):
    sensors = {"tacho": {"body": "motor", "measures": "speed", "column": "tacho"}}
    config = with_sizes()
    machine = {**config.machine.model_dump(exclude_unset=True), "sensors": sensors}
    described = type(config).model_fields["machine"].annotation.model_validate(machine)
    law = config.law.model_copy(update={"feedback": "tacho"})
    assert acceleration(config.model_copy(update={"machine": described, "law": law})) is None
