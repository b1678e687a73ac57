"""Position estimates from camera images."""

import numpy as np
import pytest

from rtctl.identify import camera


def test_share_and_half_range_of_camera_images():
    found = camera.images([-0.9e-3, -0.4e-3, 0.1e-3, 0.5e-3, 1.1e-3])
    assert found.share == pytest.approx(0.6) and found.half_range == pytest.approx(1e-3)
    assert camera.images(found.off, 0.7e-3).share == pytest.approx(0.4)


def test_camera_images_are_taken_while_the_tape_rests():
    t = np.arange(0, 2, 0.002)
    values = np.where(t < 1.5, 10 * t, 3.0)
    assert camera.at_rest(t, values, 1.99) == 3.0
