import math

import pytest
from graph_cases import BELT, PENDULUM, case_of

from rtctl.case.format2 import read_case
from rtctl.config.errors import UserError


def test_assumed_defaults_are_reported():
    case = {k: v for k, v in case_of(PENDULUM).items() if k not in ("tolerance", "delay_samples")}
    read = read_case(case, "bench")
    assert read.default_tolerance == 0.15
    assert read.delay_samples == 0.0
    assert any("tolerance is missing; 0.15 is taken" in w for w in read.warnings)
    assert any("delay_samples is missing; 0 is taken" in w for w in read.warnings)


def test_unknown_key_warning_suggests_the_nearest_name():
    read = read_case(case_of(PENDULUM, tolerence={"default": 0.1}), "bench")
    assert any("tolerence is not a key" in w and "is it 'tolerance'?" in w for w in read.warnings)


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
    ],
)
def test_invalid_case_is_refused(change, sentence):
    with pytest.raises(UserError, match=r"^bench/case\.json: ") as error:
        read_case(case_of(PENDULUM) | change, "bench")
    assert sentence in str(error.value)


def test_invalid_description_error_names_the_path():
    machine = {**BELT, "joints": {"belt": {**BELT["joints"]["belt"], "to": "carrige"}}}
    with pytest.raises(UserError, match=r"case\.json: machine.*no body 'carrige'; did you mean 'carriage'\?"):
        read_case(case_of(machine), "bench")
