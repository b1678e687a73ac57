import numpy as np
import pytest

from rtctl.case.format1 import read_case
from rtctl.diagnose.answer.config_from_case import carried, digits
from rtctl.diagnose.model.by_symbol import owner_model
from rtctl.diagnose.record.format1 import Record

AXIS = {"plant": "axis", "sample_rate": 1000.0, "parameters": {"M": 2.0}, "drive": {"newton_per_volt": 4.0}}
IVU = {
    "plant": "ivu",
    "sample_rate": 400.0,
    "sensors": {"capstan_counts_per_rev": 4002, "reel_counts_per_rev": 100},
    "drive": {"amp_per_volt": [0.3, 0.3], "limit_volt": 5.0},
    "controller": {"kind": "pd", "P": 5.0, "D": 1.0, "tension_N": 0.2, "friction_Nm": 1e-3},
}


def config_from(case) -> tuple:
    read = read_case(case, ".")
    dt, zero = 1 / read.sample_rate, np.zeros(10)
    record = Record(read.plant, read, zero, dt, zero, zero, zero[:, None], {}, {})
    return carried(owner_model(read), record)


def test_digits_rounds_to_six_figures():
    assert digits(0.0123456789) == 0.0123457
    assert digits(0.0) == 0.0
    assert digits(-123456789.0) == -123457000.0


def test_cascade_law_becomes_position_and_speed_feedback():
    data, _ = config_from({**AXIS, "controller": {"kind": "cascade_p_v", "kp": 160.0, "kv": 24.0}})
    assert data["law"]["position"] == {"kind": "pi_velocity", "gain": 3840.0, "velocity_gain": 24.0}
    assert data["loop"]["write"] == "same_tick"


def test_unknown_law_is_replaced_by_a_slow_law():
    data, left = config_from({**AXIS, "controller": {"kind": "none"}})
    law = data["law"]["position"]
    # s^2 + (K kv / M) s + K g / M with K = 4, M = 2: critically damped, 50 rad/s
    assert law["velocity_gain"] * 4 / 2 == pytest.approx(50.0)
    assert law["gain"] * 4 / 2 == pytest.approx(25.0**2)
    assert any("driven open loop" in words for words in left)


def test_law_of_the_two_reel_unit_is_translated():
    data, left = config_from(IVU)
    law = data["law"]
    assert law["position"] == {"gain": 5.0, "tau_d": 0.2}
    assert (law["tension"]["F_t"], law["tension"]["amp_per_volt"]) == (0.2, 0.3)
    assert (law["inertia"]["share"], law["friction"]["motor1"]["tau_C"]) == (0.0, 1e-3)
    assert law["limit"]["high"] == 5.0
    assert data["loop"]["rate"] == 400.0
    assert any("friction compensation" in words for words in left)


def test_sensor_resolutions_of_the_case_are_kept():
    data, _ = config_from(IVU)
    capstan = data["sensors"]["capstan"]
    assert capstan["lines"] * capstan.get("multiply", 4) == 4002
    assert data["sensors"]["reel2"]["pulses"] == 100
    data, _ = config_from({**AXIS, "sensors": {"unit": "rad", "x_counts_per_rev": 1000}})
    assert data["encoder"]["pitch"] == pytest.approx(2 * np.pi / 1000, rel=1e-5)


def test_driver_gain_comes_from_the_case():
    data, _ = config_from(IVU)
    assert data["plant"]["driver"]["ratio"] / 0.24 == pytest.approx(0.3)
