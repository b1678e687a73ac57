import pytest
from graph_cases import BELT, PENDULUM, case_of

from rtctl.case.controller import WiredCascade, WiredPd, WiredSections
from rtctl.case.format2 import read_case
from rtctl.config.errors import UserError

PD = {"kind": "pd", "P": 4.0, "D": 0.3}
TACHO = {"sensors": {"tacho": {"body": "rod", "measures": "speed", "column": "v"}}}


def read(controller, machine=PENDULUM, **more):
    """The law of a case, and its warnings."""
    case = read_case(case_of(machine) | {"controller": controller, **more}, "bench")
    return case.controller, [warning for warning in case.warnings if "controller" in warning]


def test_law_is_read_with_its_only_sensor_and_drive():
    law, warnings = read({**PD, "derivative_filter_hz": 80.0})
    assert law == WiredPd(P=4.0, D=0.3, derivative_filter_hz=80.0, sensor="encoder", drive="motor")
    assert warnings == []
    sections = [[1.0, 0.0, 0.0, 0.0, 0.0]]
    law, _ = read({"kind": "lead_lag", "sections": sections})
    assert isinstance(law, WiredSections) and law.kind == "lead_lag" and law.drive == "motor"
    law, _ = read({"kind": "cascade_p_v", "kp": 10.0, "kv": 2.0})
    assert isinstance(law, WiredCascade) and law.sensor == "encoder"


def test_law_must_name_its_sensor_if_there_are_several():
    assert read({**PD, "sensor": "scale"}, BELT)[0].sensor == "scale"
    law, (warning,) = read(PD, BELT)
    assert law is None
    assert "controller: sensor is missing; name the one that the law reads, encoder or scale; the recorded" in warning
    both = {**PENDULUM, "sensors": {**TACHO["sensors"], **PENDULUM["sensors"]}}
    assert read(PD, both)[0].sensor == "encoder"  # position is preferred over speed
    assert read(PD, {**PENDULUM, **TACHO})[0].sensor == "tacho"


@pytest.mark.parametrize(("controller", "machine", "sentence"), [
    ({"kind": "cascade_p_v", "kp": 1, "kv": 1}, {**PENDULUM, **TACHO}, "a sensor that shows the position of a body"),
    ({"kind": "mpc"}, PENDULUM, "a law of kind 'mpc' cannot be recomputed; it should be pd, sections or cascade_p_v"),
    (PD, {**PENDULUM, "drives": {}}, "the machine has no drive"),
    (PD, {**PENDULUM, "drives": {n: {"body": "rod", "column": n} for n in "ab"}}, "drive is missing; name the one"),
])  # fmt: skip
def test_unusable_law_is_a_warning(controller, machine, sentence):
    law, warnings = read(controller, machine)
    assert law is None and len(warnings) == 1
    assert sentence in warnings[0] and warnings[0].endswith("the recorded command is taken as the input")


def test_open_loop_problem_has_no_law():
    assert "in a free problem no law commands a drive" in read(PD, problem="free")[1][0]


def test_unknown_law_is_not_read():
    assert read({"kind": "pd"}, controller_known=False) == (None, [])
    assert read({"kind": "unknown"}) == (None, [])
    assert read(None) == (None, [])
    assert read_case(case_of(PENDULUM, controller={"kind": "none"}), "bench").open_loop


def test_unknown_controller_keys_are_warned_of():
    law, warnings = read({**PD, "tension_N": 0.1, "senser": "encoder"})
    assert law.sensor == "encoder"
    assert len(warnings) == 2 and "controller.senser" in warnings[1] and "is it 'sensor'?" in warnings[1]


@pytest.mark.parametrize(("controller", "more", "sentence"), [
    ("pd", {}, "controller is a str; it should be an object with a 'kind'"),
    ({"kind": 3}, {}, "controller.kind is 3; it should be a word, such as pd"),
    ({"kind": "pd", "P": 1.0}, {}, "controller: missing key 'D'"),
    ({**PD, "P": "much"}, {}, "controller"),
    ({**PD, "derivative_filter_hz": -1.0}, {}, "derivative_filter_hz"),
    ({**PD, "units": "counts"}, {}, "units"),
    ({"kind": "sections"}, {}, "controller: missing key 'sections'"),
    ({**PD, "sensor": "encodr"}, {}, "controller.sensor: there is no sensor 'encodr'; it should be encoder"),
    ({**PD, "drive": "moter"}, {}, "controller.drive: there is no drive 'moter'; it should be motor (is it 'motor'?)"),
    (PD, {"controller_known": "yes"}, "controller_known is 'yes'; it should be true or false"),
])  # fmt: skip
def test_invalid_controller_is_refused(controller, more, sentence):
    with pytest.raises(UserError, match=r"^bench/case\.json: ") as error:
        read(controller, **more)
    assert sentence in str(error.value)
