"""A path that gives with tension: the elastica round a guide, and a camera that looks through the path."""

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
    """Length less its way of a strip that is turned by `psi` on the way to where it is straight, m."""
    scale = math.sqrt(B / T)
    return quad(lambda x: (1 - math.cos(x)) * scale / (2 * math.sin(0.5 * x)), 0, psi)[0]


@pytest.mark.parametrize("alpha", [0.5, math.pi / 2, math.pi])
def test_a_small_guide_is_touched_at_one_line(alpha):
    """psi' = -2 sin(psi / 2) / lambda along the elastica, alpha / 2 on either side."""
    assert path.excess(B, T, alpha) == pytest.approx(2 * free_length(0.5 * alpha), rel=1e-9)
    assert path.excess(4 * B, T, alpha) == pytest.approx(2 * path.excess(B, T, alpha))  # sqrt(B / T)


def test_a_large_guide_is_followed_where_the_strip_bends_by_its_radius():
    """At the end of the arc the curvature of the free strip, 2 sin(psi / 2) / lambda, is 1 / r."""
    r, alpha = 0.02, math.pi / 2
    psi = 2 * math.asin(math.sqrt(B / T) / (2 * r))
    assert psi < 0.5 * alpha
    way = 2 * (free_length(psi) - r * (psi - math.sin(psi)))
    assert path.excess(B, T, alpha, r) == pytest.approx(way, rel=1e-9)
    assert 0 < way < path.excess(B, T, alpha)
    edge = math.sqrt(B / T) / (2 * math.sin(0.25 * alpha))  # of which it just begins to follow
    one, two = (path.excess(B, T, alpha, edge * (1 + d)) for d in (-1e-9, 1e-9))
    assert one == pytest.approx(two, rel=1e-6) and one < path.excess(B, T, alpha)  # limp tape has a way round it too


@pytest.mark.parametrize("power", [0.5, 1.0])
def test_longer_where_it_is_pulled_less(power):
    p = path.build_path_length(path.PathLengthSettings(node="path", excess=5e-3, power=power), 1e-3)
    assert path.longer(p, 0.1) == pytest.approx(0.0)
    assert path.longer(p, 0.025) == pytest.approx(5e-3 * (4**power - 1))
    assert path.longer(p, -1.0) == path.longer(p, 0.0) == path.longer(p, 0.005)  # slack


@pytest.mark.parametrize("pull", [1.5e-3, 6e-3])
def test_the_camera_sees_the_length_and_the_counter_does_not(pull):
    bodies = {**TAPE["bodies"], "reel": {**TAPE["bodies"]["reel"], "pull": pull}}
    term = machine.settings("tape.path_length", "path", excess=4e-3)
    done = machine.run({**TAPE, "bodies": bodies}, [term], np.zeros(3000))
    plain = machine.run({**TAPE, "bodies": bodies}, [], np.zeros(3000))
    off = done.y[-1] - plain.y[-1]
    longer = 4e-3 * (math.sqrt(0.1 * 0.03 / pull) - 1)  # T = pull / R
    assert off[0] == pytest.approx(longer / 0.0125, rel=1e-3)  # transport is backwards: an image that is late is ahead
    assert off[1] == 0.0 and done.x == pytest.approx(plain.x)


def test_a_span_gives_where_a_sensor_looks_through_it():
    term = TERMS["tape.path_length"]
    file = find("ivu-old")
    model = class_of(load_yaml(file).data)
    assert nodes(term, elements(layout(load_settings(file, model, widen=OWN).machine))) == ("path",)
    assert nodes(term, "ivu") == nodes(term, "ldu") == ()  # they have no camera
