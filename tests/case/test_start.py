from graph_cases import BELT, PENDULUM, case_of

from rtctl.case.format2 import read_case
from rtctl.case.start import is_start


def firsts(machine, **more):
    """Paths of the initial state of a machine, in order."""
    return [path for path in read_case(case_of(machine, **more), "bench").values if is_start(path)]


def test_gravity_adds_the_initial_angle_as_a_parameter():
    assert firsts(PENDULUM) == ["start.angle"]


def test_free_response_has_initial_angle_position_and_speed():
    assert firsts(PENDULUM, problem="free") == ["start.angle", "start.position", "start.speed"]


def test_body_beyond_a_compliance_has_an_initial_state_unless_its_motion_is_given():
    assert firsts(BELT) == ["start.bodies.carriage.position", "start.bodies.carriage.speed"]
    assert firsts(BELT, problem="kinematic") == []
