"""Short soaks: no violations on every machine, bit-exact for one seed, in one run or resumed."""

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.soak import progress
from rtctl.soak.invariants import INVARIANTS
from rtctl.soak.report import TIMES
from rtctl.soak.soak import soak
from rtctl.trace.bundle import load_bundle

LENGTH = {"ivu": 0.1, "ldu": 0.03, "axis": 0.05}  # h


def story(found: dict[str, Any]) -> dict[str, Any]:
    """A summary without values that depend on the computer."""
    return {k: v for k, v in found.items() if k not in (*TIMES, "out", "invariants", "complete")} | {
        "invariants": {k: v for k, v in found["invariants"].items() if k != "memory"}
    }


@pytest.fixture(scope="module")
def settings(config: Callable[..., Any]) -> Any:
    return config("ivu")


@pytest.mark.parametrize("kind", sorted(LENGTH))
def test_soak_without_violations(config: Callable[..., Any], tmp_path: Path, kind: str) -> None:
    found = soak(config(kind), LENGTH[kind], 1, True, tmp_path / "out")
    assert found["violations"] == 0, found["violation_list"]
    assert found["ticks"] == found["rows"]["recorded"] and found["rows"]["lost"] == 0
    assert found["simulated_hours"] >= LENGTH[kind] and found["complete"]
    assert found["moves"] > 0 and found["faults"] and set(found["invariants"]) == set(INVARIANTS)
    unchecked = {name for name, ticks in found["invariants"].items() if not ticks}
    assert unchecked - {"memory"} == (
        set() if kind == "ivu" else {"tension"}
    )  # a short soak does not reach the memory check
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["ticks"] == found["ticks"]


def test_soak_is_bit_exact_for_one_seed(settings: Any, tmp_path: Path) -> None:
    summaries = [soak(settings, 0.02, seed, True, tmp_path / str(i)) for i, seed in enumerate((3, 3, 4))]
    first, again, other = (story(s) for s in summaries)
    assert first == again and first["ticks"] != other["ticks"]
    with (
        np.load(tmp_path / "0" / progress.PROGRESS) as one,
        np.load(tmp_path / "1" / progress.PROGRESS) as two,
    ):
        same = {name for name in one.files if np.array_equal(one[name], two[name])}
        # values by the wall clock: histograms and the time of saving
        assert set(one.files) - same <= {"status", "m", "progress"}


def test_resumed_soak_equals_an_uninterrupted_one(settings: Any, tmp_path: Path) -> None:
    whole = soak(settings, 0.05, 5, True, tmp_path / "whole")
    asked: Iterator[int] = iter(range(1000))
    part = soak(settings, 0.05, 5, True, tmp_path / "parts", stopped=lambda: next(asked) >= 7)
    assert not part["complete"] and sum(part["events"].values()) == 7
    asked = iter(range(1000))
    part = soak(settings, 0.05, 5, True, tmp_path / "parts", resume=True, stopped=lambda: next(asked) >= 11)
    assert not part["complete"] and sum(part["events"].values()) == 18
    rest = soak(settings, 0.05, 5, True, tmp_path / "parts", resume=True)
    assert rest["complete"] and story(rest) == story(whole)


def test_killed_soak_continues_from_its_last_progress_file(settings: Any, tmp_path: Path) -> None:
    asked: Iterator[int] = iter(range(1000))
    soak(settings, 0.2, 1, False, tmp_path, stopped=lambda: next(asked) >= 3)
    early = (tmp_path / progress.PROGRESS).read_bytes()
    whole = soak(settings, 0.2, 1, False, tmp_path, resume=True)
    assert list(tmp_path.glob("capture-*"))
    (tmp_path / progress.PROGRESS).write_bytes(early)  # later events are already on disk
    assert story(soak(settings, 0.2, 1, False, tmp_path, resume=True)) == story(whole)


def test_violation_is_kept_across_a_resume(config: Callable[..., Any], tmp_path: Path) -> None:
    broken = config("ivu", set={"sensors.capstan.pulse_width": 1e-3})
    found = soak(broken, 0.02, 1, False, tmp_path / "out")
    assert found["violations"] > 0 and found["violated"]["counters"] > 0
    first = found["violation_list"][0]
    assert first["name"] == "counters" and first["seed"] == 1
    rows = load_bundle(tmp_path / "out" / first["bundle"]).columns
    assert first["tick"] in rows["tick"] and np.all(np.diff(rows["tick"]) == 1)
    again = soak(broken, 0.03, 1, False, tmp_path / "out", resume=True)
    assert again["violation_list"][0] == first and again["violations"] >= found["violations"]
    assert len(again["violation_list"]) <= 20


def test_soak_without_faults_has_no_violations(settings: Any, tmp_path: Path) -> None:
    found = soak(settings, 0.05, 1, False, tmp_path / "out")
    assert found["violations"] == 0 and not found["faults"] and not found["trips"]


def test_captures_are_bundles_of_the_requested_length(settings: Any, tmp_path: Path) -> None:
    soak(settings, 0.2, 1, False, tmp_path / "out")
    folders = sorted((tmp_path / "out").glob("capture-*"))
    assert 0 < len(folders) <= 8
    for folder in folders:
        assert len(load_bundle(folder).columns["t"]) == 751  # 1.5 s at 500 Hz, both ends


def test_resume_of_another_soak_is_refused(settings: Any, config: Callable[..., Any], tmp_path: Path) -> None:
    with pytest.raises(UserError, match="nothing to resume"):
        soak(settings, 0.01, 1, True, tmp_path, resume=True)
    soak(settings, 0.005, 1, True, tmp_path)
    with pytest.raises(UserError, match="holds a soak already"):
        soak(settings, 0.005, 1, True, tmp_path)
    with pytest.raises(UserError, match="another --seed"):
        soak(settings, 0.005, 2, True, tmp_path, resume=True)
    with pytest.raises(UserError, match="another --faults"):
        soak(settings, 0.005, 1, False, tmp_path, resume=True)
    with pytest.raises(UserError, match="another config"):
        soak(config("ivu"), 0.005, 1, True, tmp_path, resume=True)  # different machine name
    (tmp_path / progress.PROGRESS).write_bytes(b"PK\x03\x04 half a file")
    with pytest.raises(NoAnswer, match="cannot be read"):
        soak(settings, 0.005, 1, True, tmp_path, resume=True)


@pytest.mark.usefixtures("runtime")
def test_soak_of_separate_processes_has_no_violations_and_cannot_be_resumed(
    config: Callable[..., Any], tmp_path: Path
) -> None:
    if not os.access("/dev/shm", os.W_OK):
        pytest.skip("/dev/shm cannot be written: loop and supervisor share memory there")
    live = config("ivu", mode="lockstep", link="shm")
    found = soak(live, 0.05, 1, True, tmp_path / "out")
    assert found["violations"] == 0, found["violation_list"]
    assert found["mode"] == "lockstep" and found["ticks"] >= 0.05 * 3600 * 500
    assert found["rows"]["recorded"] + found["rows"]["lost"] == found["ticks"] and found["moves"] > 0
    with pytest.raises(UserError, match="cannot be resumed"):
        soak(live, 0.05, 1, True, tmp_path / "out", resume=True)
