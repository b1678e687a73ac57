"""Trips in the log; failures of the recording in the console, the log and the exit code of `rtctl run`."""

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from structlog.testing import capture_logs

from rtctl.cli.console import RunConsole
from rtctl.cli.main import main
from rtctl.config.errors import RunFailed
from rtctl.config.load import to_yaml
from rtctl.daemon.events import Recording, Trips
from rtctl.daemon.session import whole
from rtctl.daemon.supervisor import Supervisor
from rtctl.tick import safety
from rtctl.trace import moved, recorder
from rtctl.trace.bundle import load_bundle
from rtctl.trace.orders import orders
from rtctl.trace.stream import StreamWriter

HOLD = 2000  # tick at which the run waits while the test changes its folder
Run = Callable[[Callable[[Path], Any]], tuple[int, dict[str, Any], str]]


@pytest.fixture
def run(
    runtime: Path,
    config: Callable[..., Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> Run:
    """`run(what)`: `rtctl run` of 12 s that calls `what(folder)` at tick HOLD; returns exit code, JSON, stderr."""
    monkeypatch.setattr(recorder, "LOOK", 0.0)
    settings = config(set={"record.seconds": 2.0})
    (tmp_path / "ivu.yaml").write_text(to_yaml(settings))

    def play(what: Callable[[Path], Any]) -> tuple[int, dict[str, Any], str]:
        done: list[bool] = []

        def update(_: RunConsole, supervisor: Supervisor) -> None:
            if not done and supervisor.status["tick"] >= HOLD:
                done.append(True)
                what(tmp_path / "bundle")
                supervisor.status["hold"] = 0

        def held(self: Supervisor) -> Iterator[None]:
            self.status["hold"] = HOLD  # tick beyond the capacity of the ring before the first turn
            yield from turns(self)

        turns = Supervisor.run
        monkeypatch.setattr(Supervisor, "run", held)
        monkeypatch.setattr(RunConsole, "update", update)
        words = ["--for", "12s", "--out", str(tmp_path / "bundle"), "--json", "--no-plot"]
        code = main(["run", str(tmp_path / "ivu.yaml"), *words])
        out, err = capfd.readouterr()
        assert done
        return code, json.loads(out or "{}"), err

    return play


def test_recording_follows_a_folder_renamed_during_the_run(run: Run, tmp_path: Path) -> None:
    code, result, said = run(lambda folder: folder.rename(folder.with_name("other")))
    assert code == 1 and result["bundle"] == str(tmp_path / "other")
    assert f"recording: {tmp_path / 'bundle'} was renamed while it was recorded" in " ".join(said.split())
    assert "the recording is now" in result["rows"]["error"] and result["rows"]["recorded"] == 6000
    assert len(load_bundle(tmp_path / "other").columns["tick"]) == 6000 and not (tmp_path / "bundle").exists()


def test_recording_is_rescued_when_its_folder_is_deleted_during_the_run(run: Run, tmp_path: Path) -> None:
    code, result, _ = run(shutil.rmtree)
    rescued = tmp_path / "bundle-rescued"
    assert code == 1 and result["bundle"] == str(rescued) and "was deleted" in result["rows"]["error"]
    assert len(load_bundle(rescued).columns["tick"]) == 6000 and len(orders(rescued)) == 1


def test_full_disk_sets_the_exit_code(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> int:
        raise OSError(28, "No space left on device")

    code, result, said = run(lambda _: monkeypatch.setattr(StreamWriter, "write", full))
    assert code == 1 and result["ticks"] == 6000 and result["lost_rows"] > 0
    assert "No space left" in result["rows"]["error"] and "recording: [Errno 28] No space left" in said


def test_whole_raises_for_an_interrupted_or_incomplete_recording() -> None:
    good = {"interrupted": False, "rows": {"error": None}}
    assert whole(good) is good
    with pytest.raises(RunFailed, match="recording: full"):
        whole({**good, "rows": {"error": "full"}})
    with pytest.raises(KeyboardInterrupt):
        whole({**good, "interrupted": True})


def test_rows_that_cannot_be_rescued_are_reported_as_lost(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(moved, "copied", full)
    code, _, said = run(shutil.rmtree)
    assert code == 2 and "the rows could not be rescued: they are lost" in said.splitlines()[-1]


def test_recording_failure_is_reported_once() -> None:
    said: list[str] = []
    watch = Recording(said.append)
    for trouble in (None, "full", "full", "full; moved", "full; moved"):
        watch.look(trouble)
    assert said == ["recording: full", "recording: full; moved"]


ROW = np.dtype([("tick", "<i8"), ("t", float), ("trip", float), ("link_age", float), ("x", float), ("truth_x", float)])


def rows(trips: list[int], first: int = 0) -> np.ndarray:
    made = np.zeros(len(trips), ROW)
    made["tick"] = np.arange(first, first + len(trips))
    made["t"], made["trip"], made["x"] = made["tick"] * 1e-3, trips, made["tick"] + 1 / 3
    return made


def test_each_trip_is_logged_once_with_the_signals_of_its_tick() -> None:
    trips = Trips()
    with capture_logs() as said:
        trips.feed(rows([0, 0, safety.FOLLOWING, safety.FOLLOWING]))
        trips.feed(rows([safety.FOLLOWING, 0, 0], 4))
        trips.feed(rows([safety.LINK], 7))
    assert [(s["event"], s["cause"], s["tick"], s["t"], s["log_level"]) for s in said] == [
        ("trip", "following_error", 2, 0.002, "error"), ("trip", "link_lost", 7, 0.007, "error")
    ]  # fmt: skip
    assert said[0]["x"] == 2.3333 and "truth_x" not in said[0] and "link_age" not in said[0]
    assert said[0]["why"] == safety.TRIPS[safety.FOLLOWING][1]
