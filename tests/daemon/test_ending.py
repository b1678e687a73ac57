"""Runs whose loop fails while the supervisor lives: the bundle is complete and names the failure."""

import json
import os
import signal
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rtctl.cli.console import RunConsole
from rtctl.cli.main import main
from rtctl.config.errors import RunFailed, UserError
from rtctl.config.load import to_yaml
from rtctl.daemon import ending, starting
from rtctl.daemon.shared_memory import segment_path
from rtctl.daemon.supervisor import Supervisor
from rtctl.trace.bundle import load_bundle

LONG = 4000.0  # s of virtual time; the loop is killed long before


def kill_loop(supervisor: Supervisor, number: int = signal.SIGKILL, after: int = 600) -> None:
    if supervisor.status["tick"] > after and supervisor.loop.running():
        os.kill(supervisor.loop.pid, number)


def test_killed_loop_leaves_a_complete_bundle_and_one_message(
    runtime: Path,
    config: Callable[..., Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    heads = []

    def update(_: RunConsole, supervisor: Supervisor) -> None:
        kill_loop(supervisor)
        heads.append(supervisor.segment["ring"][0])

    monkeypatch.setattr(RunConsole, "update", update)
    settings = config()
    (tmp_path / "ivu.yaml").write_text(to_yaml(settings))
    out = tmp_path / "bundle"
    code = main(["run", str(tmp_path / "ivu.yaml"), "--for", f"{LONG}s", "--out", str(out), "--json", "--no-plot"])
    told, said = capfd.readouterr()
    assert code == 1 and "internal error" not in said and "Traceback" not in said
    assert "rtctl: the loop's process died after tick " in said
    assert "killed by SIGKILL (out of memory? see `dmesg`" in said.splitlines()[-1]
    found = load_bundle(out)
    rows = len(found.columns["tick"])
    assert rows == heads[0]["head"] > 600 and (found.columns["tick"] == np.arange(rows)).all()
    assert found.case["complete"] is True and found.case["run"]["failure"] in said
    result = json.loads(told)
    assert result["failure"] in said and result["rows"]["recorded"] == rows
    assert not segment_path(settings.name).exists()


def test_error_reported_by_a_child_ends_the_run_with_a_complete_bundle(
    runtime: Path, config: Callable[..., Any], tmp_path: Path
) -> None:
    reports = [{"event": "error", "message": "the plant stopped answering"}]
    supervisor = Supervisor(config(), tmp_path / "bundle", round(LONG * 500))
    supervisor.armed_at_start = True
    with supervisor:
        supervisor.loop.reports = lambda: [reports.pop()] if reports else []  # type: ignore[method-assign]
        for _ in supervisor.run():
            pass
        supervisor.finish()
    assert isinstance(supervisor.failure, UserError)
    found = load_bundle(tmp_path / "bundle")
    assert found.case["run"]["failure"] == "the plant stopped answering"
    assert 0 < found.case["rows"] < LONG * 500


def test_supervisor_waits_for_an_error_report_after_the_last_tick() -> None:
    order: list[str] = []
    loop = SimpleNamespace(process=SimpleNamespace(wait=lambda _: order.append("waited"), poll=lambda: 2))

    def hear() -> None:
        order.append("heard")
        raise UserError("no plant")

    assert str(ending.failure(loop, {"failed": 1, "ended": 1, "tick": 3}, hear)) == "no plant"
    assert order == ["waited", "heard"]
    assert ending.failure(loop, {"failed": 0, "ended": 1, "tick": 3}, lambda: None) is None


@pytest.mark.parametrize(("code", "words"), [(-9, "killed by SIGKILL (out of memory"), (-40, "killed by signal 40")])
def test_failure_names_the_signal_that_killed_the_process(code: int, words: str) -> None:
    child = SimpleNamespace(process=SimpleNamespace(poll=lambda: code), last_words=lambda: "")
    assert starting.ended(child).startswith(words)
    with pytest.raises(RunFailed, match="died after tick 7: killed by"):
        child.process.wait = lambda _: None
        raise ending.failure(child, {"failed": 0, "ended": 0, "tick": 7}, lambda: None) or AssertionError
