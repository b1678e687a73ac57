from functools import cache
from pathlib import Path

import numpy as np
import pytest
from graph_cases import RATE, case_of, columns_of, record

from rtctl.case.format2 import read_case
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.held import likelier, other_way, suits
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.model.recording import record_of

FINER = 10  # samples of the smooth command between two rows
SPRUNG = {
    "bodies": {"mass": {"mass": 2.0, "viscous": 4.0}},
    "joints": {"spring": {"from": "frame", "to": "mass", "stiffness": 800.0, "damping": 1.0}},
    "drives": {"shaker": {"body": "mass", "column": "u", "kind": "force", "gain": 5.0}},
    "sensors": {"gauge": {"body": "mass", "measures": "position", "column": "x", "counts_per_unit": 1e7}},
}
CASE = case_of(SPRUNG, delay_samples=0.0, controller={"kind": "none"})


def tones(t):
    """Command (n,), smooth between the rows, zero at the start."""
    rng = np.random.default_rng(4)
    waves = sum(np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in (3.0, 7.0, 19.0, 41.0))
    return waves * np.minimum(t / 0.5, 1.0)


@cache
def recorded(smooth):
    """Recording under the smooth command, or under the command held over each row."""
    fine = tones(np.arange(round(4.0 * RATE * FINER)) / (RATE * FINER))
    u = fine[::FINER]
    if not smooth:
        return record(CASE, u)
    shown = columns_of({**CASE, "sample_rate": RATE * FINER}, fine)
    columns = {"t": np.arange(len(u)) / RATE, "u": u, "x": shown["x"][::FINER]}
    return record_of(columns, read_case(CASE, "bundle"), Path("bundle/recording.parquet"))


@pytest.mark.parametrize("smooth", [True, False])
def test_smooth_and_held_commands_are_distinguished(smooth):
    like, space = together([recorded(smooth)])
    assert (likelier(like, space) is not like) == smooth
    told = suits(refit(like, space))
    assert (told is not None) == smooth


def test_switching_the_command_interpolation_twice_is_the_identity():
    like, _ = together([recorded(True)])
    there = other_way(like)
    assert not np.array_equal(there.sim.volts, like.sim.volts)
    assert np.array_equal(other_way(there).sim.volts, like.sim.volts)


def test_command_of_a_controller_is_held():
    like, space = together([record(case_of(SPRUNG), recorded(True).u[:, 0])])
    assert other_way(like) is None and suits(refit(like, space)) is None
    assert likelier(like, space) is like
