"""Replay of a recording through its law: bit-exact outputs, a changed gain, and refused recordings."""

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from rtctl.cli.main import main
from rtctl.config.errors import NoAnswer, UserError
from rtctl.daemon.protocol import OPS
from rtctl.daemon.supervisor import Supervisor
from rtctl.tick import safety
from rtctl.trace.orders import ORDERS
from rtctl.trace.replay import replay

GAIN = "law.position.gain"
TICKS = 20_000


def record(config: Any, folder: Path, told: dict[int, list[tuple[str, dict[str, Any]]]], ticks: int) -> Path:
    """A run in lockstep with orders at given ticks."""
    with Supervisor(config, folder, ticks) as machine:
        waiting = sorted(told.items())
        for _ in machine.run():
            off = machine.status["state"] != safety.RUNNING
            if not waiting or machine.status["tick"] < waiting[0][0] or (off and waiting[0][1][0][0] != "arm"):
                continue
            for op, args in waiting.pop(0)[1]:
                machine.commands.handle(op, OPS[op](**args))
        assert not waiting
        machine.finish()
    return folder


@pytest.fixture(scope="session")
def recorded(runtime: Path, config: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    told: dict[int, list[tuple[str, dict[str, Any]]]] = {
        0: [("arm", {})],
        500: [("setpoint", {"value": 1.0, "ramp": 2.0})],
        800: [("set", {"path": GAIN, "value": 22.0}), ("set", {"path": "law.tension.F_t", "value": "0.12 N"})],
        1200: [("fault", {"action": "add", "fault": {"fault": "encoder.missed", "size": 0.05, "lasts": 0.3}})],
        1300: [("setpoint", {"value": -0.5}), ("setpoint", {"value": 0.5})],
        2200: [("disarm", {})],
        2300: [("arm", {})],
        2600: [("play", {})],
    }
    settings = config("ivu", mode="lockstep", set={"record.trace": ["position.d"], "record.seconds": 0.2})
    return record(settings, tmp_path_factory.mktemp("recorded") / "run", told, TICKS)


@pytest.fixture
def copy(recorded: Path, tmp_path: Path) -> Iterator[Path]:
    """A copy of the recording for modification."""
    yield Path(shutil.copytree(recorded, tmp_path / "copy"))
    shutil.rmtree(tmp_path / "copy")


def change(folder: Path, column: str, row: int, value: float) -> None:
    path = folder / "recording.parquet"
    table = pq.read_table(path)
    values = table.column(column).to_pylist()
    values[row] = value
    at = table.column_names.index(column)
    pq.write_table(table.set_column(at, table.schema.field(at), [values]), path)


def test_replay_with_all_orders_is_bit_exact(recorded):
    found = replay(recorded)
    assert found.identical and found.same_program and not found.stopped
    assert len(found.rows) == TICKS and found.written == ("u1", "u2")
    assert {"u_c", "ref", "state", "order", "position_d"} <= set(found.compared)
    assert not {"capstan", "truth_capstan", "t"} & set(found.compared)
    assert found.rows["order"][-1] >= 9 and found.rows["u1"].any()


def test_changed_output_is_found(copy):
    change(copy, "u1", 1700, 0.125)
    found = replay(copy)
    (one,) = found.differences
    assert (one.column, one.tick, one.ticks, one.recorded) == ("u1", 1700, 1, 0.125)


def test_changed_measurement_changes_the_outputs_from_its_tick(copy):
    change(copy, "capstan_counts", 1700, 100_000.0)
    change(copy, "capstan", 1700, 10.0)
    assert replay(copy).differences[0].tick == 1700


def test_replay_with_another_gain_gives_different_outputs(recorded):
    found = replay(recorded, {GAIN: 11.0})
    changed = {d.column for d in found.differences}
    assert {"u1", "u2", "u_c"} <= changed and not {"ref", "state"} & changed
    assert (found.rows["state"] == found.recorded["state"]).all()


def test_replay_stops_at_a_gap(copy):
    path = copy / "recording.parquet"
    table = pq.read_table(path)
    keep = [k for k in range(TICKS) if not 3000 <= k < 3010]
    pq.write_table(table.take(keep), path)
    found = replay(copy)
    assert found.identical and len(found.rows) == 3000 and found.stopped == "rows behind tick 2999 are missing"


def test_recording_without_its_start_cannot_be_replayed(copy):
    path = copy / "recording.parquet"
    pq.write_table(pq.read_table(path).slice(100), path)
    with pytest.raises(NoAnswer, match="begins at tick 100"):
        replay(copy)


def test_recording_without_its_journal_cannot_be_replayed(copy):
    (copy / ORDERS).unlink()
    with pytest.raises(NoAnswer, match="is not in the journal"):
        replay(copy)


@pytest.mark.parametrize("column", ["capstan_counts", "lateness", "order"])
def test_replay_needs_every_column_that_the_law_reads(copy, column):
    path = copy / "recording.parquet"
    pq.write_table(pq.read_table(path).drop([column]), path)
    with pytest.raises(NoAnswer, match=f"column '{column}' is missing"):
        replay(copy)


def test_foreign_recording_cannot_be_replayed(copy):
    path = copy / "case.json"
    case = json.loads(path.read_text())
    path.write_text(json.dumps({**case, "config": None}))
    with pytest.raises(NoAnswer, match="no rtctl `config`"):
        replay(copy)
    path.write_text(json.dumps({**case, "config": {**case["config"], "lore": 1}}))
    with pytest.raises(UserError, match="lore"):
        replay(copy)


def test_replay_command(recorded, copy, tmp_path, capsys):
    assert main(["replay", str(recorded)]) == 0
    assert f"{TICKS} ticks" in (out := capsys.readouterr().out) and "identical to the bit" in out
    change(copy, "u1", 1700, 0.125)
    assert main(["replay", str(copy), "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert not said["identical"] and said["differences"][0]["tick"] == 1700
    picture = tmp_path / "gain.png"
    assert main(["replay", str(recorded), "--set", f"{GAIN}=11", "--plot", str(picture)]) == 0
    assert "the measurements are as recorded" in capsys.readouterr().out
    assert picture.stat().st_size > 10_000
    assert main(["replay", str(recorded), "--set", "gain"]) == 2
    assert main(["replay", str(recorded), "--set", "law.position.gian=3"]) == 2
