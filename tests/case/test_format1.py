import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from known_cases import case_of

from rtctl.case.format1 import believed, read_case
from rtctl.case.laws import CascadeLaw, NoLaw, PdLaw, SectionsLaw, UnknownLaw, pd_section
from rtctl.config.errors import UserError


def refused(case):
    with pytest.raises(UserError) as error:
        read_case(case, "bundle")
    return str(error.value)


def test_nominal_values_are_read():
    case = read_case(case_of("ivu"), "bundle")
    assert case.sample_rate == 500.0
    assert case.parameters["R1"] == 0.038
    assert case.drive.amp_per_volt == (0.2, 0.2)
    assert case.drive.step_volt == pytest.approx(20 / 4096)
    assert isinstance(case.controller, PdLaw)
    assert case.controller_known
    assert (case.tolerance("J_m1"), case.tolerance("R1"), case.tolerance("R_c")) == (0.15, 0.02, 0.0)


def test_more_sections_than_the_simulation_supports_are_refused():
    controller = {"kind": "long", "sections": [[1.0, 0.0, 0.0, 0.0, 0.0]] * 9}
    assert "controller: sections: has 9 items" in refused(case_of("ldu", controller=controller))


def test_each_kind_of_controller_is_read():
    assert isinstance(read_case(case_of("ldu"), "b").controller, SectionsLaw)
    assert isinstance(read_case(case_of("axis"), "b").controller, CascadeLaw)
    assert isinstance(read_case(case_of("axis", controller={"kind": "none"}), "b").controller, NoLaw)
    pd = read_case(case_of("ldu", controller={"kind": "pd", "P": 2.0, "D": 0.1, "derivative_filter_hz": 50}), "b")
    assert isinstance(pd.controller, SectionsLaw)


def test_pd_as_a_section_has_its_dc_gain_and_slope():
    b0, b1, b2, a1, a2 = pd_section(2360.5, 154.4335, 200.0, 1e-4)
    assert (b0 + b1 + b2) / (1 + a1 + a2) == pytest.approx(2360.5)
    assert b0 == pytest.approx(2360.5 + 154.4335 * (1 - math.exp(-2 * math.pi * 200 * 1e-4)) / 1e-4)


def test_unknown_controller_is_a_warning_and_the_command_is_the_input():
    case = read_case(case_of("ldu", controller={"kind": "sliding_mode"}), "bundle")
    assert isinstance(case.controller, UnknownLaw)
    assert not case.controller_known
    assert "sliding_mode" in case.unsaid


def test_unknown_key_warning_suggests_the_nearest_name():
    strange = case_of("ivu", parameters__tau_FC=1.0, drive__limit_volts=5.0, sensors__colour="red", delay_sample=2.0)
    warnings = " ".join(read_case(strange, "bundle").warnings)
    for said in (
        "parameters.tau_FC",
        "'tau_Fc'",
        "drive.limit_volts",
        "'limit_volt'",
        "sensors.colour",
        "'delay_samples'",
    ):
        assert said in warnings


def test_keys_of_the_daemon_give_no_warning():
    case = case_of("axis", config={}, seed=1, versions={}, run={}, changes=[], rows=5, losses={}, complete=True)
    assert read_case(case, "bundle").warnings == ()


def test_rotary_axis_has_an_inertia_in_place_of_a_mass():
    drive = {"newton_metre_per_ampere": 0.0083, "unit": "A"}
    case = read_case(case_of("axis", parameters={"J": 2.5e-4}, drive=drive, sample_rate=None), "bundle")
    assert case.sample_rate is None
    assert believed(case) == {"M": 2.5e-4, "K": 0.0083, "F_v": 0.0, "F_c": 0.0, "k": 0.0}


def test_absent_terms_are_zero_and_absent_parameters_have_the_model_defaults():
    case = read_case(case_of("ivu"), "bundle")
    full = believed(case)
    assert full["tau_F1"] == 0.0024
    assert (full["tau_F2"], full["tau_Fc"], full["d_tape"]) == (0.0, 0.0, 0.0)
    assert full["c1"] == 450.0
    assert full["J_1"] > full["J_10"]
    assert "c1" in case.warnings[-1]
    assert "tau_F2" not in case.warnings[-1]
    assert believed(read_case(case_of("ldu"), "bundle"))["F_c"] == 0.0


def test_tolerance_null_is_infinite():
    case = read_case(case_of("axis", parameters={}, reaches={"parameter_tolerance": None}), "bundle")
    assert case.tolerance("M") == math.inf
    assert "M" not in believed(case)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"plant": "ivo"}, ("plant is 'ivo'", "is it 'ivu'")),
        ({"plant": None}, ("plant is None", "ivu, ldu or axis")),
        ({"sample_rate": 0}, ("sample_rate is 0", "above 0 Hz")),
        ({"sample_rate": "fast"}, ("sample_rate is 'fast'", "number")),
        ({"delay_samples": -1}, ("delay_samples is -1", "between 0 and 100")),
        ({"parameters__J_m1": -0.0015}, ("parameters.J_m1", "more than 0")),
        ({"parameters__tau_F1": -1e-3}, ("parameters.tau_F1", "at least 0")),
        ({"parameters__R1": math.nan}, ("parameters.R1 is nan", "finite")),
        ({"parameters__R1": 10**400}, ("parameters.R1", "finite")),
        ({"parameters__R1": "3 cm"}, ("parameters.R1 is '3 cm'", "SI")),
        ({"parameters__R1": True}, ("parameters.R1 is True", "SI")),
        ({"parameters": [1]}, ("parameters is a list",)),
        ({"drive__amp_per_volt": [0.2]}, ("drive.amp_per_volt has 1", "2")),
        ({"drive__amp_per_volt": [0.2, -0.2]}, ("drive.amp_per_volt", "above 0")),
        ({"drive__limit_volt": -3}, ("drive: limit_volt", "more than 0")),
        ({"drive__dac_bits": "twelve"}, ("drive: dac_bits",)),
        ({"sensors__capstan_counts_per_rev": 0}, ("sensors: capstan_counts_per_rev", "more than 0")),
        ({"controller__P": None}, ("controller: P",)),
        ({"controller__allocation": "both"}, ("controller: allocation", "differential")),
        ({"controller": "pd"}, ("controller is a str",)),
        ({"controller_known": "yes"}, ("controller_known is 'yes'", "true or false")),
        ({"reaches__parameter_tolerance": -0.1}, ("reaches: parameter_tolerance",)),
        ({"reaches__parameter_tolerance": math.inf}, ("reaches.parameter_tolerance", "finite")),
    ],
)
def test_invalid_value_is_refused_with_its_key(change, said):
    message = refused(case_of("ivu", **change))
    assert message.startswith("bundle/case.json")
    assert "\n" not in message
    for part in said:
        assert part in message


def test_two_values_of_one_parameter_are_refused():
    assert "one and the same" in refused(case_of("axis", parameters={"J": 1.0, "M": 2.0}))
    assert "N is -20" in refused(case_of("ldu", parameters__N=-20.0))


anything = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@settings(deadline=None, max_examples=150)
@given(
    st.sampled_from(["ivu", "ldu", "axis"]),
    st.dictionaries(
        st.sampled_from(["sample_rate", "parameters", "sensors", "drive", "controller", "reaches", "notes", "x"]),
        anything,
    ),
)
def test_any_case_is_read_or_a_user_error(plant, keys):
    try:
        read_case({"plant": plant, **keys}, "bundle")
    except UserError as error:
        assert str(error).startswith("bundle/case.json")


@pytest.mark.parametrize("name", [f"case-{k:04d}" for k in range(1, 25)])
def test_practice_cases_are_read_without_a_warning(shared, name):
    folder = shared(f"blind/practice/{name}")
    case = read_case(json.loads((folder / "case.json").read_text()), folder)
    assert case.warnings == ()
    assert case.controller_known
    assert set(case.parameters) <= set(believed(case))


def test_estimated_parameter_has_an_infinite_tolerance():
    case = read_case(case_of("axis", parameters={"F_c": 0.2}), "bundle")
    assert case.estimated == ("M", "F_v", "k")
    assert [case.tolerance(name) for name in ("M", "F_v", "k")] == [math.inf] * 3
    assert case.tolerance("F_c") == 0.15
    known = read_case(case_of("axis", parameters={"M": 2.0, "F_v": 1.0}, drive={"newton_per_volt": 3.0}), "bundle")
    assert known.estimated == ()
    assert known.tolerance("F_v") == 0.15
    assert read_case(case_of("axis", parameters={"M": 2.0}, drive={}), "bundle").estimated == ("K",)


@pytest.mark.parametrize("plant", ["ivu", "ldu", "axis"])
def test_user_plant_is_refused(plant):
    said = refused(case_of(plant, config={"machine": plant, "plant": {"kind": "./my_plant.py:Plant"}}))
    assert "./my_plant.py:Plant" in said
    assert "replay" in said and "not there yet" in said


@pytest.mark.parametrize("value", [0, -1, "two", float("nan"), float("inf"), [1], {}, True])
@pytest.mark.parametrize("name", ["M", "K", "J", "K_m"])
def test_impossible_parameter_error_has_the_name_and_unit_of_the_axis(name, value):
    said = refused(case_of("axis", parameters={name: value}, sensors={"unit": "rad"}))
    unit = {"M": "kg m^2", "J": "kg m^2"}.get(name, "Nm/V")
    assert said.startswith(f"bundle/case.json: parameters.{name}") and "kg;" not in said
    assert "should be a" in said or f"it must be more than 0 {unit}" in said


def test_assumed_tolerance_is_reported():
    silent, given = (read_case(case_of("axis", reaches=r), "bundle") for r in ({}, {"parameter_tolerance": 0.15}))
    assert silent.tolerance("M") == given.tolerance("M") == 0.15
    assert [w for w in silent.warnings if "reaches.parameter_tolerance is missing; 0.15 is taken" in w]
    assert not [w for w in given.warnings if "tolerance" in w]
    nothing = read_case(case_of("axis", reaches={"parameter_tolerance": None}), "bundle")
    assert nothing.tolerance("M") == math.inf and not [w for w in nothing.warnings if "tolerance" in w]
    assert not [w for w in read_case(case_of("axis", reaches={}, parameters={}), "b").warnings if "tolerance" in w]


def test_error_names_both_names_of_one_parameter():
    said = refused(case_of("axis", parameters={"J": 1.0, "M": 1.0}))
    assert "parameters.J and parameters.M are one and the same" in said


@pytest.mark.parametrize(("part", "unit"), [("sensors", "deg"), ("sensors", ""), ("drive", "furlong"), ("drive", 5)])
def test_unit_of_no_axis_is_refused(part, unit):
    said = refused(case_of("axis", **{f"{part}__unit": unit}))
    assert f"{part}: unit" in said and "is not one of" in said
