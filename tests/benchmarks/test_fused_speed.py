"""C twins of the benchmark are bit-exact with the generated ticks; the printed JSON is complete."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


@pytest.fixture(scope="module")
def twins(benchmark_module: Callable[[str], ModuleType]) -> ModuleType:
    return benchmark_module("twins")


@pytest.mark.parametrize(("kind", "ticks"), [("ivu", 2_000), ("ldu", 12_000)])
def test_c_twins_are_bit_exact_with_the_generated_ticks(
    twins: ModuleType, tmp_path: Path, kind: str, ticks: int
) -> None:
    machine = twins.machine_of(kind)
    ours = twins.Ours(machine)
    c = twins.Reference(machine, ours.made.row, len(ours.rows), tmp_path)
    ours.run(ticks)
    c.run(ticks)
    assert ours.rows["state"][ticks - 1] == 2
    assert np.ptp(ours.rows["target"][:ticks]) > 0  # the machine moved
    different = [n for n in ours.rows.dtype.names if not np.array_equal(ours.rows[n][:ticks], c.rows[n][:ticks])]
    assert different == []


def test_trace_with_another_column_is_refused(twins: ModuleType, tmp_path: Path) -> None:
    row = np.dtype([("tick", np.int64), ("t", np.float64), ("new", np.float64)])
    with pytest.raises(ValueError, match="struct row"):
        twins.Reference(twins.machine_of("ldu"), row, 10, tmp_path)


def test_json_has_both_figures() -> None:
    command = [sys.executable, str(BENCHMARKS / "fused_speed.py"), "--json", "--machine", "ldu", "--windows", "1"]
    out = subprocess.run([*command, "--seconds", "1"], capture_output=True, text=True, check=True).stdout
    told = json.loads(out)["ldu"]
    assert told["identical"]
    assert told["agrees_to"] == 0.0
    assert told["x_realtime"] > 0
    assert told["ratio_to_c"] > 0


def test_percentiles_of_cyclictest_are_inside_their_bucket(benchmark_module: Callable[[str], ModuleType]) -> None:
    lateness = benchmark_module("lateness")
    told = lateness.percentiles({"1000": 50, "2000": 49}, 100)  # one wake-up beyond all buckets
    assert told["p50"] == pytest.approx(1.001)
    assert told["p99"] == pytest.approx(2.001)
    assert told["p999"] >= lateness.LONGEST_NS / 1000
