"""Inverse of the static drive characteristic."""

import numpy as np
import pytest

from rtctl.config.load import set_paths
from rtctl.improve import curve, found
from rtctl.improve.lines import swept
from rtctl.laws import inverse_curve


def output_behind_inverse(config, wanted):
    """Output of the drive (V) behind its inverse curve, for the requested output `wanted` (V)."""
    points = curve.inverse(found.of_config(config, "a test"))
    p = inverse_curve.build(inverse_curve.InverseCurveSettings(points=points), 0.001)
    asked = np.array([inverse_curve.step(p, value) for value in wanted])
    return swept(config.plant.physics, "command", config.kind, asked)


@pytest.mark.parametrize("entry", [
    {"term": "drive.deadband", "band": 0.5},
    {"term": "drive.offset", "offset": 0.7},
    {"term": "drive.gain_asymmetry", "a": 0.2},
])  # fmt: skip
def test_inverse_curve_linearises_the_drive(entry, with_sizes):
    config = set_paths(with_sizes(), {"plant.physics": [{**entry, "node": "amplifier"}]})
    wanted = np.concatenate([np.linspace(-7.0, -0.2, 30), np.linspace(0.2, 7.0, 30)])
    assert np.abs(output_behind_inverse(config, wanted) - wanted).max() < 0.06


def test_inverse_curve_covers_all_effects_of_a_drive(with_sizes):
    entries = [
        {"term": "drive.offset", "node": "amplifier", "offset": 0.4},
        {"term": "drive.deadband", "node": "amplifier", "band": 0.5},
    ]
    config = set_paths(with_sizes(), {"plant.physics": entries})
    wanted = np.linspace(1.0, 6.0, 20)
    assert np.abs(output_behind_inverse(config, wanted) - wanted).max() < 0.06


def test_inverse_of_a_dead_band_has_a_bounded_slope(with_sizes):
    points = np.array(curve.inverse(found.of_config(with_sizes(dead_band=0.5), "a test")))
    slope = np.diff(points[:, 1]) / np.diff(points[:, 0])
    assert slope.max() <= 1.05 * curve.STEEP
    assert np.all(np.diff(points, axis=0) > 0)


def test_drive_without_static_effect_has_no_inverse_curve(with_sizes):
    config = set_paths(with_sizes(), {"plant.physics": [{"term": "friction.coulomb", "node": "motor", "F_C": 1e-3}]})
    assert curve.inverse(found.of_config(config, "a test")) is None
