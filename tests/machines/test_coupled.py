"""Machine with mechanics from a file: closed loop in one process and in two, and replay."""

import os

import fused
import numpy as np
import pytest

from rtctl.cli.common import with_loop
from rtctl.config.load import set_path
from rtctl.daemon.session import Session
from rtctl.trace.bundle import load_bundle
from rtctl.trace.replay import replay

LENGTH = 1.5  # s


@pytest.fixture(scope="module")
def run(runtime, tmp_path_factory):
    def make(mode):
        config = fused.config("machines/furuta", safety__link_timeout=5.0, safety__missed_ticks=0)
        config = set_path(config, "name", f"furuta{os.getpid()}")
        folder = tmp_path_factory.mktemp("run") / "bundle"
        assert Session(with_loop(config, mode, "shm"), folder, LENGTH).run()["tripped"] is None
        return folder

    return make


@pytest.fixture(scope="module")
def bundle(run):
    return run("fused")


def test_arm_follows_the_reference_and_the_pendulum_swings(bundle):
    rows = load_bundle(bundle).columns
    assert rows["truth_arm"][-1] == pytest.approx(np.radians(60.0), abs=0.05)
    assert rows["truth_arm"].max() < 1.05 * np.radians(60.0)
    assert np.abs(rows["truth_pendulum"]).max() > 0.05
    moved = np.abs(rows["pendulum_counts"] - np.floor(rows["truth_pendulum"] * 2048 / (2 * np.pi)))
    assert moved.max() <= 1.0


def test_coupled_machine_in_lockstep_is_bit_exact_with_fused(run, bundle):
    one, other = (load_bundle(folder).columns for folder in (bundle, run("lockstep")))
    assert [name for name in one if not np.array_equal(one[name], other[name])] == []


def test_coupled_machine_replays_bit_exact(bundle):
    assert replay(bundle).identical
