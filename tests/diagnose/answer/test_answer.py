import pytest
from graph_cases import named, nothing, unnamed

from rtctl.case.start import START
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED, Effect


def test_nominal_machine_has_the_verdict_nothing():
    d = nothing()
    assert d.verdict == NOTHING
    assert not d.effects
    assert d.located is None
    assert d.headline.startswith("Nothing is missing")
    assert d.heldout.before < 2 * d.heldout.floor
    for path, v in d.parameters.items():
        nominal = 0.0 if path == START else d.record.case.values[path]  # the case stores its exponential
        assert v.low <= nominal <= v.high, path


def test_dry_friction_of_the_carriage_is_named_with_its_interval():
    d = named()
    assert d.verdict == NAMED
    assert [(e.name, e.node) for e in d.effects] == [("friction.coulomb", "carriage")]
    force = d.effects[0].parameters["F_C"]
    assert force.low <= 2.0 <= force.high
    assert force.unit == "N"
    assert "The carriage rubs" in d.headline
    assert d.heldout.after < 0.2 * d.heldout.before


def test_force_without_a_matching_law_is_unnamed():
    d = unnamed()
    assert d.verdict == UNNAMED
    assert not d.effects
    assert d.located.node == "rod"
    assert d.decided.why


@pytest.mark.parametrize("d", [nothing, named, unnamed])
def test_diagnosis_json_has_the_keys_of_the_exchange_format(d):
    data = d().as_json()
    assert {
        "verdict",
        "effects",
        "located",
        "parameters",
        "fit",
        "cannot_test",
        "separating_experiment",
        "seconds",
    } <= set(data)
    assert set(data["fit"]) == {"heldout_nrmse_before", "heldout_nrmse_after", "noise_floor"}
    assert all(len(p["ci90"]) == 2 for p in data["parameters"].values())


def test_headline_names_a_rival_without_a_size():
    d = named()
    rival = Effect("drive.gain_asymmetry", "amplifier", 0.3, {}, (), "friction.coulomb:carriage")
    effects = (d.effects[0]._replace(confidence=0.6), rival)
    told = d._replace(decided=d.decided._replace(verdict=AMBIGUOUS), effects=effects)
    assert "most probably dry friction at the carriage and unequal gain at the amplifier together (30 %)" in (
        told.headline
    )
