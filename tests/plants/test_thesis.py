"""The descriptions of the three machines give the equations of the thesis."""

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import tests.plants.thesis as thesis
from rtctl.idiom import tick
from rtctl.plants import axis, ivu, ldu, linear
from rtctl.plants.graph import plant as graph
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.layout import layout

DRIVES = [(0.2, 2e3, 0.7, 1e-4), (0.21, 1.8e3, 0.6, 0.0)]
FREE: dict[str, Any] = {"tau_F1": 0.0, "tau_F2": 0.0, "tau_Fc": 0.0}


@tick
def run(p, s, n):
    for _ in range(n):
        linear.midpoint(s.m)
        s.m.f[0], s.m.f[4] = 0.2, 0.02
        graph.weigh(p, s.m)
        linear.advance(s.m)


@tick
def run_linear(s, n):
    for _ in range(n):
        linear.midpoint(s.m)
        linear.advance(s.m)


def started(p: Any) -> Any:
    s = np.zeros(1, graph.GRAPH_STATE).view(np.recarray)[0]
    graph.start(p.graph, s)
    return s


def assert_same_matrices(got: tuple, wanted: tuple) -> None:
    for one, two in zip(got, wanted, strict=True):
        assert np.abs(one - two).max() <= 1e-13 * np.abs(two).max()
        assert np.array_equal(one == 0.0, two == 0.0)


@pytest.mark.parametrize("name", ivu.SETS)
def test_state_space_of_the_two_reel_unit(name):
    p = ivu.build(ivu.IvuSettings(set=name), 5e-4, DRIVES)
    assert_same_matrices(ivu.state_space(p), thesis.ivu(p, DRIVES))


@pytest.mark.parametrize("name", ldu.SETS)
def test_state_space_of_the_linear_drive(name):
    p = ldu.build(ldu.LduSettings(set=name), 5e-5, (6e3, 0.7))
    assert_same_matrices(ldu.state_space(p), thesis.ldu(p, 6e3, 0.7))


def test_winding_motion_matches_the_integrated_equations_of_the_thesis():
    """0.4 s of winding across relinearisations against Runge-Kutta; relative error 2e-6 of the angles."""
    p = ivu.build(ivu.IvuSettings(parameters={**FREE, "d_tape": 2e-3}), 1e-4, DRIVES)
    s = started(p)
    run(p.graph, s, 4000)
    wanted = thesis.runge_kutta(p, np.array([0.2, 0.0, 0.0, 0.0, 0.02]), 0.4, 20_000)
    assert abs(wanted[1]) > 2.0 and s.m.reel_R_lin[0] > 1.01 * p.R1
    np.testing.assert_allclose(s.m.x[:5], wanted[:5], rtol=0, atol=2e-6 * np.abs(wanted[:5]).max())
    np.testing.assert_allclose(s.m.x[5:10], wanted[5:], rtol=0, atol=5e-6 * np.abs(wanted[5:]).max())


def test_motion_of_the_linear_drive_matches_the_matrix_exponential():
    p = ldu.build(ldu.LduSettings(parameters={"F_c": 0.0}), 5e-5, (6e3, 0.7))
    A, B = thesis.ldu(p, 6e3, 0.7)
    M = np.zeros((11, 11))
    M[:10, :10], M[:10, 10:] = A, B
    wanted = (expm(M * 0.05) @ np.r_[np.zeros(10), 1.0])[:10] * 0.1
    s = started(p)
    s.m.u[0] = 0.1
    run_linear(s, 1000)
    np.testing.assert_allclose(s.m.x[:10], wanted, rtol=1e-9, atol=1e-12 * np.abs(wanted).max())


@pytest.mark.parametrize("module", [ivu, ldu, axis])
def test_node_names_and_indices_of_a_plant_match_its_description(module):
    at = module.described().layout
    for name, number in module.NODES.items():
        assert at.coordinate(name) == number
    assert dict(at.drives) == module.DRIVES
    assert dict(at.sensors) == module.SENSORS
    assert all(number in at.links.values() for number in module.LINKS.values())
    for name in set(module.LINKS) & set(at.links):
        assert at.links[name] == module.LINKS[name]
    build = {ivu: (DRIVES,), ldu: ((6e3, 0.7),), axis: ()}[module]
    settings = getattr(module, f"{module.__name__.rpartition('.')[2].capitalize()}Settings")()
    p = module.build(settings, 1e-3, *build).graph
    assert (p.nq, p.nx, p.nu, p.ny, p.nl) == (module.NQ, module.NX, module.NU, module.NY, module.NL)


@pytest.mark.parametrize("module", [ivu, ldu, axis])
def test_every_parameter_of_a_set_changes_the_machine(module):
    """A parameter without effect on the machine could not be fitted."""
    build = {ivu: (DRIVES,), ldu: ((6e3, 0.7),), axis: ()}[module]
    kind = module.__name__.rpartition(".")[2].capitalize()
    settings = getattr(module, f"{kind}Settings")

    def numbers(**parameters: float) -> np.ndarray:
        p = module.build(settings(parameters=parameters), 1e-3, *build).graph
        return np.concatenate([np.ravel(np.asarray(part, float)) for part in p])

    before, values = numbers(), module.parameters(settings()).model_dump() if module is not axis else {}
    values = values or settings().parameters.model_dump()
    for name, value in values.items():
        assert not np.array_equal(numbers(**{name: 1.01 * value + 1e-6}), before) or name in ("J_10", "J_20"), name


def test_description_of_a_shipped_machine_has_its_layout():
    machine = ldu.described().layout.machine
    assert layout(Description.model_validate(machine.model_dump())).nq == ldu.NQ
