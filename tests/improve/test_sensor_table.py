"""Error table of a sensor."""

import numpy as np
import pytest

from rtctl.config.load import set_paths
from rtctl.improve import found, sensor_table
from rtctl.improve.lines import swept
from rtctl.laws import error_table


@pytest.mark.parametrize("entry", [
    {"term": "sensor.scale", "relative": 0.01},
    {"term": "ripple.encoder", "A": 0.004, "order": 1},
])  # fmt: skip
def test_error_table_corrects_the_reading_over_the_travel(entry, with_sizes):
    config = set_paths(with_sizes(), {"plant.physics": [{**entry, "node": "encoder"}]})
    table, anchored = sensor_table.of(found.of_config(config, "a test"), (0.0, 12.0))
    p = error_table.build(error_table.ErrorTableSettings(**table), 0.001)
    x = np.linspace(0.0, 12.0, 97)
    shown = swept(config.plant.physics, "reading", config.kind, x)
    right = np.array([error_table.step(p, value) for value in shown])
    assert np.abs(right - x).max() < 0.06 * np.abs(shown - x).max()
    assert not anchored  # a counter


def test_sensor_outside_the_loop_gets_no_error_table(with_sizes):
    config = set_paths(with_sizes(), {"plant.physics": [{"term": "sensor.scale", "node": "scale", "relative": 0.01}]})
    assert sensor_table.of(found.of_config(config, "a test"), (0.0, 12.0)) is None
