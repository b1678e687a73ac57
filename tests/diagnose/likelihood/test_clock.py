from functools import cache
from pathlib import Path

import numpy as np
import pytest
from graph_cases import PENDULUM, RATE, case_of, columns_of, command, nothing

from rtctl.case.format2 import read_case
from rtctl.diagnose.answer.answer import diagnose_record
from rtctl.diagnose.likelihood.clock import clock, timed
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.model.recording import record_of

OFF = 3e-4  # s, standard deviation of the tick times
COUNTS = 5000.0


def read_at(u, late):
    """Record of a nominal pendulum, sampled `late` (n,) s after each tick."""
    case = case_of(PENDULUM)
    fine = {**case, "machine": {**PENDULUM, "sensors": {"encoder": {**PENDULUM["sensors"]["encoder"],
            "counts_per_unit": 1e6}}}}  # fmt: skip
    columns = columns_of(fine, u)
    x = columns["rod_counts"] / 1e6
    columns["rod_counts"] = np.floor(COUNTS * (x + late * np.gradient(x, 1.0 / RATE)))
    return record_of(columns, read_case(case, "bundle"), Path("bundle/recording.parquet"))


@cache
def unsteady():
    u = command(4.0)
    return read_at(u, OFF * np.random.default_rng(5).standard_normal(len(u)))


def fitted(record):
    like, space = together([record])
    return refit(like, space)


def test_clock_jitter_is_estimated():
    found = clock(fitted(unsteady()))
    assert found.sigma == pytest.approx(OFF, rel=0.1)
    assert found.low < found.sigma < found.high
    assert found.probability > 0.9


def test_regular_clock_has_a_low_jitter_probability():
    assert clock(nothing().found.base).probability < 0.2


def test_clock_jitter_is_named_with_its_size():
    d = diagnose_record(unsteady())
    assert d.verdict == "named"
    assert [(e.name, e.node) for e in d.effects] == [("timing.jitter", "loop")]
    assert "clock" in d.headline
    assert d.located is not None and d.located.node == "loop"
    size = d.effects[0].parameters["sigma"]
    assert size.unit == "s" and size.low < OFF < size.high


def test_commands_are_held_for_the_estimated_tick_times():
    fit = fitted(unsteady())
    told = timed(fit, clock(fit))
    before, after = fit.like.sim.volts, told.sim.volts
    assert after.shape == before.shape
    assert 0.0 < np.abs(after - before).max() < 0.2 * np.abs(before).max()
