"""Guide errors: at their position, zero at the start, visible only at the scale."""

import math

import numpy as np
import pytest
import stand
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.plants.physics import guide

H = 1e-3


def thickness(A: float, wavelength: float = 0.15, phi: float = 0.0) -> guide.ThicknessParams:
    return guide.build_thickness(guide.ThicknessSettings(node="scale", A=A, wavelength=wavelength, phi=phi), H)


def strip(longer: float, wavelength: float = 0.1, phi: float = 0.0) -> guide.StripParams:
    return guide.build_strip(guide.StripSettings(node="scale", longer=longer, wavelength=wavelength, phi=phi), H)


def dirt(A: float, at: float, width: float = 1e-3) -> guide.DirtParams:
    return guide.build_dirt(guide.DirtSettings(node="scale", A=A, at=at, width=width), H)


@settings(deadline=None)
@given(st.floats(-1e-3, 1e-3), st.floats(-4, 4), st.floats(-2, 2), st.floats(0.01, 1))
def test_thickness_error_is_periodic_and_zero_at_the_start(A, phi, x, wavelength):
    p = thickness(A, wavelength, phi)
    assert guide.thickness(p, 0.0) == pytest.approx(0.0, abs=1e-18)
    assert abs(guide.thickness(p, x)) <= 2 * abs(A)
    assert guide.thickness(p, x + wavelength) == pytest.approx(guide.thickness(p, x), abs=1e-12)


@pytest.mark.parametrize("phi", [0.0, 1.0])
def test_strip_error_is_the_excess_path_length(phi):
    """Waviness of 0.1 mm over 100 mm (figure 11.4), by numerical integration."""
    k = 2 * math.pi / 0.1
    x = np.linspace(0, 0.37, 100_001)
    slope = 1e-4 * k * np.cos(k * x + phi)
    longer = np.trapezoid(np.sqrt(1 + slope**2) - 1, x)
    p = strip((1e-4 * math.pi / 0.1) ** 2, phi=phi)
    assert guide.strip(p, 0.37) == pytest.approx(-longer, rel=1e-4)
    assert guide.strip(p, 0.0) == 0.0
    assert guide.strip(strip(0.0), 0.37) == 0.0


@settings(deadline=None)
@given(st.floats(0, 0.01), st.floats(-1, 1), st.floats(-1, 1), st.floats(-4, 4))
def test_path_along_a_wavy_strip_is_monotone(longer, x, y, phi):
    p = strip(longer, phi=phi)
    one, two = sorted((x, y))
    assert guide.strip(p, two) <= guide.strip(p, one) + 1e-15


def test_dirt_error_is_a_bell_at_its_position():
    p = dirt(2e-5, 0.1)
    assert guide.dirt(p, 0.1) == pytest.approx(2e-5)
    assert guide.dirt(p, 0.11) == pytest.approx(0.0, abs=1e-20)
    assert guide.dirt(p, 0.101) == guide.dirt(p, 0.099) == pytest.approx(2e-5 * math.exp(-0.5))
    assert guide.dirt(dirt(2e-5, 0.0), 0.0) == 0.0  # start on the dirt: zero there, an offset elsewhere
    assert guide.dirt(dirt(2e-5, 0.0), 0.1) == pytest.approx(-2e-5)


@pytest.mark.parametrize("node", ["carriage", "scale"])
@pytest.mark.parametrize("name", ["guide.thickness", "guide.strip", "guide.dirt"])
def test_guide_error_changes_only_the_scale(name, node):
    u = stand.excitation("ldu")
    size = {"guide.strip": {"longer": 1e-4}, "guide.dirt": {"A": 1e-5, "at": 0.01}}.get(name, {"A": 1e-5})
    one, two = stand.run("ldu", [], u), stand.run("ldu", [stand.make(name, "ldu", node, **size)], u)
    assert np.array_equal(one.x, two.x) and np.array_equal(one.y[:, 0], two.y[:, 0])
    assert np.abs(two.y - one.y)[:, 1].max() > 1e-6
