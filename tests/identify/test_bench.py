"""Common parts of bench experiments: checked settings, trips, and length of a config."""

import bench_runs as runs
import numpy as np
import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.identify import bench


def test_settings_of_an_experiment_are_validated():
    config = bench.changed(runs.config("ivu"), {"law.position.gain": 3.0})
    assert config.law.position.gain == 3.0
    assert config.excitation.kind == "none"
    with pytest.raises(UserError, match="gian"):
        bench.changed(config, {"law.position.gian": 3.0})


def test_tripped_experiment_is_refused():
    config = bench.changed(
        runs.config("ivu"),
        {
            "plant.parameters.tau_F1": 1.0,
            "plant.parameters.tau_F2": 1.0,
            "reference": {"steps": [{"at": 0.5, "to": 1.0}]},
        },
    )
    with pytest.raises(NoAnswer, match=r"tripped, \w+ at [\d.]+ s"):
        bench.play(config)


def test_length_of_an_experiment_config():
    steps = {"steps": [{"at": 1.0, "to": 2.0, "ramp": 0.5}, {"at": 6.0, "to": 0.0}]}
    config = bench.changed(runs.config("ivu"), {"reference": steps})
    assert bench.seconds(config) == pytest.approx(6.0 + bench.REST + bench.ARMING["given"])
    knots = bench.changed(config, {"reference": {"knots": [[0.0, 0.0], [9.0, 1.0]]}})
    assert bench.seconds(knots) > 9.0


def test_ramps_of_an_experiment():
    t = np.arange(0, 10, 0.01)
    ref = np.interp(t, [0, 1, 4, 5, 9, 10], [0, 0, 3, 3, -1, -1])
    found = bench.ramps(t, ref, 0.5)
    assert [(t[a], t[b - 1]) for a, b in found] == [pytest.approx((1, 4), abs=0.03), pytest.approx((5, 9), abs=0.03)]
    assert bench.ramps(t, 0 * t, 0.5) == []
