"""Tension-dependent path length: the elastica around a guide, and a camera behind the path."""

import math

import machine
import numpy as np
import pytest
from scipy.integrate import quad

from rtctl.config.load import load_settings
from rtctl.config.yaml_file import find, load_yaml
from rtctl.machines import OWN, class_of
from rtctl.plants.graph.elements import elements
from rtctl.plants.graph.layout import layout
from rtctl.plants.physics import TERMS, nodes
from rtctl.plants.physics import path_length as path

B, T = 1e-5, 0.1  # Nm^2, N
TAPE = {  # a capstan held by a spring, and a reel that a coupling pulls at
    "bodies": {"reel": {"inertia": 1e-4, "radius": 0.03, "pull": 3e-3}, "capstan": {"inertia": 1e-4, "radius": 0.0125}},
    "joints": {
        "path": {"from": "capstan", "to": "reel", "span": "open", "stiffness": 450.0, "damping": 12.5},
        "motor": {"from": "frame", "to": "capstan", "stiffness": 10.0, "damping": 0.1},
    },
    "drives": {"motor": {"body": "capstan", "column": "u", "kind": "force", "gain": 10.0}},
    "sensors": {
        "camera": {"body": "capstan", "through": "path", "column": "image"},
        "counter": {"body": "capstan", "column": "counts", "counts_per_unit": 1000.0},
    },
}  # fmt: skip


def free_length(psi: float) -> float:
    """Excess length (m) of a free strip that turns by `psi` until it is straight."""
    scale = math.sqrt(B / T)
    return quad(lambda x: (1 - math.cos(x)) * scale / (2 * math.sin(0.5 * x)), 0, psi)[0]


@pytest.mark.parametrize("alpha", [0.5, math.pi / 2, math.pi])
def test_excess_length_at_a_small_guide_matches_the_elastica(alpha):
    """psi' = -2 sin(psi / 2) / lambda along the elastica, alpha / 2 on each side."""
    assert path.excess(B, T, alpha) == pytest.approx(2 * free_length(0.5 * alpha), rel=1e-9)
    assert path.excess(4 * B, T, alpha) == pytest.approx(2 * path.excess(B, T, alpha))  # sqrt(B / T)


def test_excess_length_at_a_large_guide_includes_the_arc_of_contact():
    """The curvature of the free strip at the end of the arc, 2 sin(psi / 2) / lambda, is 1 / r."""
    r, alpha = 0.02, math.pi / 2
    psi = 2 * math.asin(math.sqrt(B / T) / (2 * r))
    assert psi < 0.5 * alpha
    way = 2 * (free_length(psi) - r * (psi - math.sin(psi)))
    assert path.excess(B, T, alpha, r) == pytest.approx(way, rel=1e-9)
    assert 0 < way < path.excess(B, T, alpha)
    edge = math.sqrt(B / T) / (2 * math.sin(0.25 * alpha))  # smallest radius with an arc of contact
    one, two = (path.excess(B, T, alpha, edge * (1 + d)) for d in (-1e-9, 1e-9))
    assert one == pytest.approx(two, rel=1e-6) and one < path.excess(
        B, T, alpha
    )  # a limp tape also has a path around the guide


@pytest.mark.parametrize("power", [0.5, 1.0])
def test_path_length_falls_with_tension_by_its_power_law(power):
    p = path.build_path_length(path.PathLengthSettings(node="path", excess=5e-3, power=power), 1e-3)
    assert path.longer(p, 0.1) == pytest.approx(0.0)
    assert path.longer(p, 0.025) == pytest.approx(5e-3 * (4**power - 1))
    assert path.longer(p, -1.0) == path.longer(p, 0.0) == path.longer(p, 0.005)  # slack


@pytest.mark.parametrize("pull", [1.5e-3, 6e-3])
def test_path_length_changes_the_camera_and_not_the_counter(pull):
    bodies = {**TAPE["bodies"], "reel": {**TAPE["bodies"]["reel"], "pull": pull}}
    term = machine.settings("tape.path_length", "path", excess=4e-3)
    done = machine.run({**TAPE, "bodies": bodies}, [term], np.zeros(3000))
    plain = machine.run({**TAPE, "bodies": bodies}, [], np.zeros(3000))
    off = done.y[-1] - plain.y[-1]
    longer = 4e-3 * (math.sqrt(0.1 * 0.03 / pull) - 1)  # T = pull / R
    assert off[0] == pytest.approx(longer / 0.0125, rel=1e-3)  # backward transport: a late image reads ahead
    assert off[1] == 0.0 and done.x == pytest.approx(plain.x)


def test_path_length_term_needs_a_sensor_behind_the_span():
    term = TERMS["tape.path_length"]
    file = find("ivu-old")
    model = class_of(load_yaml(file).data)
    assert nodes(term, elements(layout(load_settings(file, model, widen=OWN).machine))) == ("path",)
    assert nodes(term, "ivu") == nodes(term, "ldu") == ()  # without a camera
