from graph_cases import PENDULUM, case_of
from known_cases import case_of as known_case

from rtctl.case.format1 import Case
from rtctl.case.graph_case import GraphCase
from rtctl.case.load import read_case


def test_case_that_names_a_plant_is_of_format_1():
    assert isinstance(read_case(known_case("ldu"), "bench"), Case)
    assert isinstance(read_case(case_of(PENDULUM), "bench"), GraphCase)
    assert isinstance(read_case({**case_of(PENDULUM), "plant": None}, "bench"), GraphCase)
