"""Comparison with cyclictest and LinuxCNC: counts, figures, and missing peers."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def peers(benchmark_module: Callable[[str], ModuleType]) -> ModuleType:
    return benchmark_module("peers")


@pytest.fixture(scope="module")
def session(benchmark_module: Callable[[str], ModuleType]) -> ModuleType:
    return benchmark_module("hal.session")


def late(p50: float) -> dict[str, float]:
    return {"p50": p50, "p99": 2 * p50, "p999": 3 * p50}


def run(p50: float, tick: float = 0.25) -> dict[str, Any]:
    return {"lateness_us": late(p50), "tick_us": late(tick), "missed": 1, "ticks": 100}


def law(ns: float) -> dict[str, float]:
    return {"middle": ns, **late(ns)}


def hal(p50: float, ns: float) -> dict[str, Any]:
    return {"lateness_us": late(p50), "law_ns": law(ns), "thread_ns": law(2 * ns), "ticks": 100}


def test_ratio_is_the_median_over_the_rounds(peers: ModuleType) -> None:
    done = {
        "ours": [run(10.0), run(20.0), run(90.0)],
        "cyclictest": [late(10.0), late(10.0), late(100.0)],
        "hal": [hal(20.0, 100.0), hal(20.0, 100.0), hal(30.0, 50.0)],
        "law": [law(50.0), law(40.0), law(125.0)],
    }
    result = peers.result_of(done, {}, 10_000.0, 3.0)
    assert result["lateness_ratio"]["cyclictest"] == {"p50": 1.0, "p99": 1.0, "p999": 1.0}
    assert result["lateness_ratio"]["hal"]["p50"] == 1.0
    assert result["law_ratio"] == 0.5
    assert result["tick_to_hal_law"] == 2.5
    assert result["met"] == {"lateness_cyclictest": True, "lateness_hal": True, "law": True}
    assert result["ours"]["ticks"] == 300
    assert "times HAL's" in peers.report(result)


def test_missed_target_is_reported(peers: ModuleType) -> None:
    done = {"ours": [run(12.0)], "cyclictest": [late(10.0)], "hal": [hal(10.0, 10.0)], "law": [law(21.0)]}
    result = peers.result_of(done, {}, 10_000.0, 3.0)
    assert result["met"] == {"lateness_cyclictest": False, "lateness_hal": False, "law": False}
    assert "missed: law" in peers.report(result)


def test_failed_peer_is_left_out(peers: ModuleType) -> None:
    done = {"ours": [run(12.0)] * 2, "cyclictest": [late(10.0)] * 2, "hal": [hal(10.0, 10.0)], "law": [law(5.0)] * 2}
    result = peers.result_of(done, {"hal": "it gave up"}, 10_000.0, 3.0)
    assert "hal" not in result and "law_ratio" not in result and set(result["lateness_ratio"]) == {"cyclictest"}
    assert "not compared with hal: it gave up" in peers.report(result)


def test_cost_is_robust_to_interrupted_ticks(peers: ModuleType) -> None:
    counts = np.array([100] * 99 + [1_000_000])
    found = peers.cost(counts, 2.0)
    assert found["middle"] == found["p50"] == 50.0
    assert found["p999"] > 100_000.0


@pytest.mark.parametrize("json_", [True, False])
def test_missing_peers_are_exit_code_3(tmp_path: Path, json_: bool) -> None:
    command = [sys.executable, str(BENCHMARKS / "peers.py"), *(["--json"] if json_ else [])]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PATH": str(tmp_path)})
    assert done.returncode == 3, done.stderr
    said = json.loads(done.stdout)["skipped"] if json_ else done.stdout
    # another reason without SCHED_FIFO or a second CPU
    assert any(word in said for word in ("cyclictest is not installed", "SCHED_FIFO", "one CPU"))


def test_law_runs_at_every_tick(benchmark_module: Callable[[str], ModuleType]) -> None:
    took, per_ns = benchmark_module("hal.law").run(2_000.0, 0.05, 1)
    assert len(took) == 100 and (took > 0).all()
    assert per_ns > 0


def test_rows_after_an_overrun_do_not_count(session: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "samples").write_text("1 2 3 4 \noverrun\n5 6 7 8 \n9 10\n")
    assert session._times(tmp_path / "samples").tolist() == [[1, 2, 3, 4], [5, 6, 7, 8]]


@pytest.fixture(scope="module")
def library(session: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    try:
        return session.build(tmp_path_factory.mktemp("hal"))
    except (session.NoPeerError, OSError) as reason:
        pytest.skip(f"no C compiler that makes wakeup.so: {reason}")


def test_every_absolute_sleep_is_counted(session: ModuleType, library: Path, tmp_path: Path) -> None:
    """The sleep of Python is also clock_nanosleep(TIMER_ABSTIME) on CLOCK_MONOTONIC."""
    counts = tmp_path / "counts"
    counts.write_bytes(bytes(4 * (session.BUCKETS + 1)))
    code = "import time\nfor _ in range(20): time.sleep(0.001)"
    subprocess.run(
        [sys.executable, "-S", "-c", code], env={"LD_PRELOAD": str(library), "WAKEUP": str(counts)}, check=True
    )
    found = np.fromfile(counts, np.uint32)
    assert found.sum() == 20
    assert found[0] == 0  # no sleep ends early or at once


@pytest.mark.realtime
def test_hal_thread_gives_lateness_and_times(
    peers: ModuleType, session: ModuleType, library: Path, tmp_path: Path
) -> None:
    reason = session.why_not()
    if reason is not None:
        pytest.skip(reason)
    folder = Path("/tmp") / f"rtb-test-{os.getpid()}"  # accessible to rtapi_app, which runs as another user
    folder.mkdir(mode=0o711)
    try:
        shared = folder / "wakeup.so"
        shared.write_bytes(library.read_bytes())
        window = session.run(shared, 1_000.0, 0.2, folder)
    except session.NoPeerError as reason:
        pytest.skip(str(reason))
    finally:
        subprocess.run(["rm", "-rf", str(folder)], check=True)
    assert window.wakeups.sum() >= 150
    assert window.times.shape == (200, 4)
    assert (window.times[:, :3].sum(axis=1) > 0).all()
