from graph_cases import BELT, PENDULUM, case_of

from rtctl.case.format2 import read_case
from rtctl.case.start import is_start


def firsts(machine, **more):
    """Paths of the first state of a machine, in their order."""
    return [path for path in read_case(case_of(machine, **more), "bench").values if is_start(path)]


def test_a_weight_asks_for_the_zero_of_the_angle():
    assert firsts(PENDULUM) == ["start.angle"]


def test_a_free_response_begins_anywhere():
    assert firsts(PENDULUM, problem="free") == ["start.angle", "start.position", "start.speed"]


def test_a_body_behind_a_spring_has_a_first_state_unless_its_motion_is_given():
    assert firsts(BELT) == ["start.bodies.carriage.position", "start.bodies.carriage.speed"]
    assert firsts(BELT, problem="kinematic") == []
