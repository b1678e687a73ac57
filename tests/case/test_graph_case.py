import math

from graph_cases import BELT, case_of

from rtctl.case.format2 import read_case


def test_paths_and_tolerances_of_a_description():
    case = read_case(case_of(BELT, tolerance={"default": 0.2, "joints.belt": 0.05, "bodies.motor.dry": None}), "bench")
    assert case.values["joints.belt.stiffness"] == 4e4
    assert case.tolerance("bodies.carriage.mass") == 0.2
    assert case.tolerance("joints.belt.ratio") == 0.05  # tolerance of the joint
    assert case.tolerance("bodies.motor.dry") == math.inf
    assert case.tolerance("sensors.scale.counts_per_unit") == 0.0  # exact by default


def test_only_values_that_affect_the_motion_are_fitted():
    fitted = read_case(case_of(BELT), "bench").fitted
    assert "bodies.carriage.mass" in fitted
    assert "drives.amplifier.damping" not in fitted  # a drive without a bandwidth has no low pass
    assert not any("counts_per_unit" in path for path in fitted)
    exact = read_case(case_of(BELT, tolerance={"default": 0.1, "joints.belt.ratio": 0.0}), "bench").fitted
    assert "joints.belt.ratio" in fitted
    assert "joints.belt.ratio" not in exact
