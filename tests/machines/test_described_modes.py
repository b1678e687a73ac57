"""Described machine in every mode and over both links; its bundle is a case of format 2 and replays."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fused
import numpy as np
import pytest

from rtctl.cli.common import with_loop
from rtctl.config.load import set_path
from rtctl.daemon.session import Session
from rtctl.plants.graph.description import Description
from rtctl.trace.bundle import load_bundle
from rtctl.trace.replay import replay

LENGTH = 1.6  # s
OFF = {"safety__link_timeout": 5.0, "safety__missed_ticks": 0}  # no trip on a busy test machine


@pytest.fixture(scope="module")
def run(runtime: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    def make(mode: str, link: str) -> Path:
        config = set_path(fused.config("machines/belt", **OFF), "name", f"belt{os.getpid()}")
        folder = tmp_path_factory.mktemp("run") / "bundle"
        result = Session(with_loop(config, mode, link), folder, LENGTH).run()
        assert result["tripped"] is None and result["machine"] == "described"
        return folder

    return make


@pytest.fixture(scope="module")
def bundle(run: Callable[..., Path]) -> Path:
    return run("fused", "shm")


@pytest.mark.parametrize("link", ["zmq", "shm"])
def test_described_machine_in_lockstep_is_bit_exact_with_fused(run, bundle, link):
    one, other = (load_bundle(folder).columns for folder in (bundle, run("lockstep", link)))
    assert [name for name in one if not np.array_equal(one[name], other[name])] == []


@pytest.mark.realtime
@pytest.mark.parametrize("link", ["zmq", "shm"])
def test_described_machine_runs_in_real_mode(run, link):
    rows = load_bundle(run("real", link)).columns
    if np.diff(rows["tick"]).max() > 1 or rows["lateness"].max() > 0.05:
        pytest.skip("this machine is too busy to judge the loop by")
    assert np.abs(rows["position_error"]).max() < 1.0
    assert rows["truth_motor"][-1] == pytest.approx(12.0, abs=0.5)


def test_bundle_of_a_described_machine_is_a_case_of_format_2(bundle):
    case: dict[str, Any] = json.loads((bundle / "case.json").read_text())
    assert case["format"] == 2 and "plant" not in case and case["sample_rate"] == 1000.0
    described = Description.model_validate(case["machine"])
    assert described == fused.config("machines/belt").machine
    assert case["machine"]["bodies"]["motor"]["inertia"] == pytest.approx(2.1e-5)
    assert case["controller"] == {"kind": "unknown"} and case["controller_known"] is False
    columns = load_bundle(bundle)
    for group in ("drives", "sensors"):
        assert {element["column"] for element in case["machine"][group].values()} <= set(columns.columns)
    assert columns.units["feedback"] == "rad"


def test_described_machine_replays_bit_exact(bundle):
    assert replay(bundle).identical
