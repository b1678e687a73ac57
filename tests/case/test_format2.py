import math

import pytest
from graph_cases import BELT, PENDULUM, case_of

from rtctl.case.format2 import read_case
from rtctl.config.errors import UserError
from rtctl.diagnose.model.model import nominal


def test_paths_and_tolerances_of_a_description():
    case = read_case(case_of(BELT, tolerance={"default": 0.2, "joints.belt": 0.05, "bodies.motor.dry": None}), "bench")
    assert case.values["joints.belt.stiffness"] == 4e4
    assert case.tolerance("bodies.carriage.mass") == 0.2
    assert case.tolerance("joints.belt.ratio") == 0.05  # of the joint that it belongs to
    assert case.tolerance("bodies.motor.dry") == math.inf
    assert case.tolerance("sensors.scale.counts_per_unit") == 0.0  # exact where nobody says otherwise


def test_fitted_values_have_a_part_in_the_motion():
    fitted = read_case(case_of(BELT), "bench").fitted
    assert "bodies.carriage.mass" in fitted
    assert "drives.amplifier.damping" not in fitted  # a drive without a bandwidth has no low pass
    assert not any("counts_per_unit" in path for path in fitted)
    exact = read_case(case_of(BELT, tolerance={"default": 0.1, "joints.belt.ratio": 0.0}), "bench").fitted
    assert "joints.belt.ratio" in fitted
    assert "joints.belt.ratio" not in exact


def test_defaults_are_told():
    case = {k: v for k, v in case_of(PENDULUM).items() if k not in ("tolerance", "delay_samples")}
    read = read_case(case, "bench")
    assert read.default_tolerance == 0.15
    assert read.delay_samples == 0.0
    assert any("tolerance is missing; 0.15 is taken" in w for w in read.warnings)
    assert any("delay_samples is missing; 0 is taken" in w for w in read.warnings)


def test_strange_keys_are_told_with_the_nearest_name():
    read = read_case(case_of(PENDULUM, tolerence={"default": 0.1}), "bench")
    assert any("tolerence is not a key" in w and "is it 'tolerance'?" in w for w in read.warnings)
    read = read_case(case_of(BELT, tolerance={"default": 0.1, "bodies.moter.dry": 0.1}), "bench")
    assert any("speaks of no value of the machine" in w and "bodies.motor.dry" in w for w in read.warnings)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"machine": "belt"}, "machine is str; it should be an object with bodies and sensors"),
        ({"problem": "forced"}, "problem is 'forced'; it should be one of driven, free, kinematic, static"),
        ({"sample_rate": 0.0}, "sample_rate is 0; it should be above 0 Hz, or null where the clock is uneven"),
        ({"sample_rate": "fast"}, "sample_rate is 'fast'; it should be a finite number in SI units"),
        ({"sample_rate": True}, "sample_rate is True; it should be a finite number"),
        ({"delay_samples": -1.0}, "delay_samples is -1; it should be between 0 and 100"),
        ({"delay_samples": math.nan}, "delay_samples is nan; it should be a finite number"),
        ({"tolerance": 0.1}, "tolerance is a float; it should be an object of paths and shares"),
        ({"tolerance": {"default": -0.1}}, "tolerance.default is -0.1; it should be 0 or more, or null"),
        ({"physics": {"term": "friction.coulomb"}}, "physics should be a list of objects with 'term', 'node'"),
        ({"physics": [{"node": "rod"}]}, "physics should be a list of objects with 'term', 'node'"),
        (
            {"physics": [{"term": "friction.columb", "node": "rod"}]},
            "physics.0.term: there is no term 'friction.columb'; did you mean 'friction.coulomb'?",
        ),
        ({"physics": [{"term": "friction.coulomb", "node": "rod"}]}, "physics.0: missing key 'F_C'"),
        (
            {"physics": [{"term": "friction.coulomb", "node": "motor", "F_C": 1.0}]},
            "physics.0.node: friction.coulomb cannot stand at 'motor'; it can at rod",
        ),
        ({"inputs": []}, "inputs is a list; it should be an object of names and columns"),
        ({"inputs": {"wind": {"body": "rod"}}}, "inputs.wind"),
        ({"inputs": {"wind": {"body": "rodd", "column": "f"}}}, "there is no body 'rodd'; did you mean 'rod'?"),
    ],
)
def test_refusals(change, sentence):
    with pytest.raises(UserError, match=r"^bench/case\.json: ") as error:
        read_case(case_of(PENDULUM) | change, "bench")
    assert sentence in str(error.value)


def test_refused_description_names_the_path():
    machine = {**BELT, "joints": {"belt": {**BELT["joints"]["belt"], "to": "carrige"}}}
    with pytest.raises(UserError, match=r"case\.json: machine.*no body 'carrige'; did you mean 'carriage'\?"):
        read_case(case_of(machine), "bench")


def test_numbers_of_known_terms_are_fitted_by_path():
    known = [{"term": "friction.stribeck", "node": "rod", "F_s": 0.006, "v_s": 0.3}]
    tolerance = {"default": 0.1, "physics.0.F_s": 0.5, "physics.0.v_s": 0.0}
    case = read_case(case_of(PENDULUM, physics=known) | {"tolerance": tolerance}, "bench")
    assert "physics.0.F_s" in case.fitted
    assert "physics.0.v_s" not in case.fitted
    assert case.tolerance("physics.0.F_s") == 0.5
    model = nominal(case)
    moved = model._replace(base={**model.base, "physics.0.F_s": 0.008}).resolved()
    assert (moved.terms[0].F_s, moved.terms[0].v_s) == (0.008, 0.3)


def test_per_recording_names_values_of_the_machine():
    case = read_case(case_of(PENDULUM, per_recording=["bodies.rod.gravity"]), "bench")
    assert "bodies.rod.gravity.mass" in case.per_recording
    with pytest.raises(UserError, match=r"per_recording: there is no value bodies.rod.mas"):
        read_case(case_of(PENDULUM, per_recording=["bodies.rod.mas"]), "bench")
