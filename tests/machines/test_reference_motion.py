"""Motion along the reference: mode shape, forces and deflection, compared with hand calculations."""

import numpy as np
import pytest

from rtctl import machines
from rtctl.cli.common import load_config
from rtctl.config.load import set_paths
from rtctl.machines.compensation import ModelFeedforwardSettings
from rtctl.machines.reference_motion import motion, params


def of(path, changes=None):
    config = set_paths(load_config(path, []), {"law.compensation.feedforward": {}, **(changes or {})})
    return machines.module_of(config.kind).mechanics(config, 1.0 / config.loop.rate)


BELT = "configs/machines/belt.yaml"


def test_unconstrained_machine_moves_rigidly():
    made = motion(of(BELT))
    np.testing.assert_allclose(made.phi, [1.0, 12.7e-3], rtol=1e-9)
    assert made.phi @ (made.M * made.phi) == pytest.approx(0.21e-4 + 1.4 * 12.7e-3**2)
    assert made.phi @ made.plus == pytest.approx(0.03)
    assert made.phi @ made.D @ made.phi == pytest.approx(1e-5)


def test_tape_moves_both_reels_by_their_radii():
    made = motion(of("ivu"))
    np.testing.assert_allclose(made.phi, [12.5 / 38, 12.5 / 38, 1.0, -12.5 / 22, -12.5 / 22], rtol=1e-6)
    assert made.phi @ made.plus == pytest.approx(0.2 * 0.061 * 12.5 / 38, rel=1e-6)
    assert made.phi @ made.minus == pytest.approx(0.2 * 0.061 * 12.5 / 22, rel=1e-6)


def test_carriage_of_the_linear_drive_moves_in_metres():
    mechanics = of("ldu")
    made = motion(mechanics)
    assert made.phi @ made.plus == pytest.approx(14.0, rel=1e-3)  # N/V, thesis 12.3
    assert mechanics.k_v == 172.0


def test_machine_with_a_spring_to_the_frame_has_a_finite_mode_shape():
    made = motion(of("configs/machines/torsion.yaml"))
    assert np.all(np.isfinite(made.phi))
    assert made.phi @ made.K @ made.phi >= 0.0


def test_deflection_is_force_over_stiffness():
    mechanics = of(BELT)
    p = params(mechanics, ModelFeedforwardSettings(through="carriage"), 1e-3)
    force = np.array([0.0, -5.0])  # N at the carriage, balanced by the drive at the motor
    total = force + np.array([5.0 * 12.7e-3, 0.0])
    assert p.shift[:2] @ total == pytest.approx(5.0 / 80e3 / 12.7e-3, rel=1e-6)  # rad, lead of the motor


def test_no_deflection_shift_without_a_body():
    assert not params(of(BELT), ModelFeedforwardSettings(), 1e-3).shift.any()


def test_mechanics_file_has_no_reference_motion():
    with pytest.raises(ValueError, match=r"machine\.mechanics is a file"):
        of("configs/machines/furuta.yaml")
