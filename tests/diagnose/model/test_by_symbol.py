"""Nominal model of a case, with values estimated from the recording where the case has none."""

import numpy as np
import pytest
from known_records import at_rest, driven

from rtctl.case.format1 import read_case
from rtctl.config.errors import UserError
from rtctl.diagnose.model.by_symbol import Model, owner_model
from rtctl.diagnose.record.format1 import check
from rtctl.plants.physics import TERMS


def test_change_and_add_do_not_modify_the_model():
    model = Model("axis", {"M": 1.0, "k": 2.0})
    offset = TERMS["drive.offset"].settings(node="drive", offset=0.1)
    assert model.change(M=3.0).base == {"M": 3.0, "k": 2.0}
    assert model.add(offset).add(offset).terms == (offset, offset)
    assert model == Model("axis", {"M": 1.0, "k": 2.0})


def test_unknown_mass_spring_damper_is_estimated_from_its_record():
    """Oscillator driven in open loop by a multisine."""
    case = read_case(
        {
            "plant": "axis", "sample_rate": 600.0, "parameters": {}, "drive": {"newton_per_volt": 1.0},
            "controller": {"kind": "none"}, "reaches": {"parameter_tolerance": None},
        },
        ".",
    )  # fmt: skip
    n, dt = 6000, 1 / 600
    tones = np.arange(5, 1200) / (n * dt)  # 0.5 to 120 Hz, across the resonance at 71 Hz
    phases = np.random.default_rng(3).uniform(0, 2 * np.pi, len(tones))
    volts = 3e-3 * np.cos(2 * np.pi * np.outer(np.arange(n) * dt, tones) + phases).sum(axis=1)
    record = at_rest(case, n, u=volts[:, None])
    true = {"M": 5e-6, "F_v": 2e-4, "k": 1.0, "K": 1.0, "F_c": 0.0}
    found = owner_model(case, record._replace(y=driven(record, Model("axis", true)))).base
    for name, tolerance in (("M", 0.1), ("k", 0.1), ("F_v", 0.3)):  # accuracy of a starting value
        assert found[name] == pytest.approx(true[name], rel=tolerance), name


def test_axis_with_a_given_mass_is_not_estimated(plain):
    assert owner_model(plain.record.case, plain.record).base == owner_model(plain.record.case).base


@pytest.mark.parametrize(("given", "wanted"), [({"K": 2.0}, {"M": 1.0, "K": 2.0}), ({"M": 2.0}, {"M": 2.0, "K": 4.0})])
def test_missing_parameters_are_estimated_from_the_record(given, wanted):
    case = read_case({"plant": "axis", "sample_rate": 1000.0, "parameters": given, "controller": {"kind": "none"}}, ".")
    t = np.arange(4000) / 1000.0
    u = np.sin(2 * np.pi * 3 * t) + np.sin(2 * np.pi * 7 * t)
    x = -2.0 * (np.sin(2 * np.pi * 3 * t) / (6 * np.pi) ** 2 + np.sin(2 * np.pi * 7 * t) / (14 * np.pi) ** 2)
    record = check({"t": t, "ref": 0 * t, "w": 0 * t, "u": u, "x": x}, case)
    base = owner_model(record.case, record).base
    for name, value in wanted.items():
        assert base[name] == pytest.approx(value, rel=0.03)
    assert any("estimated from the recording" in warning for warning in record.case.warnings)


@pytest.mark.parametrize("unit", ["m", "rad"])
def test_case_without_mass_and_force_constant_is_refused(blank, unit):
    record = blank("axis", np.sin(np.arange(2000.0)), np.cos(np.arange(2000.0)), parameters={}, drive={},
                   sensors={"unit": unit})  # fmt: skip
    noun = {"m": "the moving mass (kg)", "rad": "the moment of inertia (kg m^2)"}[unit]
    with pytest.raises(UserError, match=r"case\.json: neither parameters\.M nor parameters\.K") as error:
        owner_model(record.case, record)
    assert noun in str(error.value)
