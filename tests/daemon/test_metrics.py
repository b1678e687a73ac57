"""Prometheus metrics: values are the counters of the machine, served to this host only."""

import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest
from prometheus_client.parser import text_string_to_metric_families

from rtctl.config.errors import UserError
from rtctl.daemon import metrics
from rtctl.daemon.supervisor import Supervisor
from rtctl.loop import histogram

TICKS = 3000


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind((metrics.ADDRESS, 0))
        return int(probe.getsockname()[1])


def read(port: int) -> dict[str, dict[tuple[tuple[str, str], ...], float]]:
    """Samples by name and labels."""
    text = urlopen(f"http://{metrics.ADDRESS}:{port}/metrics").read().decode()
    out: dict[str, dict[tuple[tuple[str, str], ...], float]] = {}
    for family in text_string_to_metric_families(text):
        for sample in family.samples:
            labels = tuple(sorted((k, v) for k, v in sample.labels.items() if k != "machine"))
            out.setdefault(sample.name, {})[labels] = sample.value
    return out


def test_metrics_equal_the_counters_of_the_machine(runtime: Path, config: Callable[..., Any], tmp_path: Path) -> None:
    port = free_port()
    with Supervisor(config(set={"metrics.port": port}), tmp_path / "run", TICKS) as machine:
        for _ in machine.run():
            pass
        found, status = read(port), machine.status
        assert found["rtctl_ticks_total"][()] == TICKS == status["tick"]
        assert found["rtctl_rows_recorded_total"][()] + machine.rows_counted()["queued"] == TICKS
        assert found["rtctl_state"][(("state", "idle"),)] == 1.0 and sum(found["rtctl_state"].values()) == 1.0
        assert not any(found["rtctl_trip"].values())
        for stage in ("read", "law", "write", "publish"):
            assert found["rtctl_stage_seconds_count"][(("stage", stage),)] == status[stage]["count"] > 0
            assert 0 < found["rtctl_stage_seconds_sum"][(("stage", stage),)] < 1.0
        machine.finish()
    with pytest.raises(OSError, match="refused"):
        read(port)


def test_idle_connections_beyond_the_limit_are_closed(runtime: Path, config: Callable[..., Any]) -> None:
    port = free_port()
    before = threading.active_count()
    with Supervisor(config(set={"metrics.port": port}), None, TICKS) as machine:
        held = [socket.create_connection((metrics.ADDRESS, port)) for _ in range(3 * metrics.PLACES)]
        for each in held[metrics.PLACES :]:
            assert each.recv(1) == b""  # closed at once
        assert threading.active_count() - before <= metrics.PLACES + 10
        for each in held:
            each.close()
        for _ in machine.run():
            pass


def test_metrics_port_in_use_is_named_in_the_error(runtime: Path, config: Callable[..., Any]) -> None:
    with socket.socket() as taken:
        taken.bind((metrics.ADDRESS, 0))
        taken.listen()
        port = taken.getsockname()[1]
        with (
            pytest.raises(UserError, match=f"metrics.port {port}"),
            Supervisor(config(set={"metrics.port": port}), None, 10),
        ):
            pass


def test_histogram_buckets_are_cumulative_and_complete() -> None:
    h = np.zeros(1, histogram.HISTOGRAM)[0]
    times = np.random.default_rng(1).lognormal(8.0, 2.0, 5000).astype(int)
    for ns in times:
        histogram.add(h, ns)
    pairs = histogram.octaves(h)
    assert [count for _, count in pairs] == [int((times < edge).sum()) for edge, _ in pairs]
    assert pairs[-1][1] == len(times)
    assert histogram.total(h) == pytest.approx(times.sum(), rel=0.02)
    kept = histogram.account(h)
    assert sum(count for _, count in kept["buckets"]) == kept["count"] == len(times)
