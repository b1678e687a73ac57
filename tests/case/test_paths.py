import pytest
from graph_cases import BELT, PENDULUM, case_of

from rtctl.case.format2 import read_case
from rtctl.config.errors import UserError


def test_tolerance_of_an_unknown_path_suggests_the_nearest_path():
    read = read_case(case_of(BELT, tolerance={"default": 0.1, "bodies.moter.dry": 0.1}), "bench")
    assert any("names no value of the machine" in w and "bodies.motor.dry" in w for w in read.warnings)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"tolerance": 0.1}, "tolerance is a float; it should be an object of paths and shares"),
        ({"tolerance": {"default": -0.1}}, "tolerance.default is -0.1; it should be 0 or more, or null"),
    ],
)
def test_invalid_tolerances_are_refused(change, sentence):
    with pytest.raises(UserError, match=r"^bench/case\.json: ") as error:
        read_case(case_of(PENDULUM) | change, "bench")
    assert sentence in str(error.value)


def test_per_recording_must_name_values_of_the_machine():
    case = read_case(case_of(PENDULUM, per_recording=["bodies.rod.gravity"]), "bench")
    assert "bodies.rod.gravity.mass" in case.per_recording
    with pytest.raises(UserError, match=r"per_recording: there is no value bodies.rod.mas"):
        read_case(case_of(PENDULUM, per_recording=["bodies.rod.mas"]), "bench")
