"""The pipeline from recordings to table, changes and page, in processes and on Dask workers."""

from pathlib import Path
from typing import Any

import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.trend import table, trend
from rtctl.trend.pieces import pieces_of
from tests.trend.bundles import VISCOUS, bundle

Fitted = tuple[Path, dict[str, Any]]


def test_friction_change_is_found_with_its_day_and_size(fitted: Fitted) -> None:
    change = fitted[1]["changes"][0]
    assert fitted[1]["alarms"] == 1 and len(fitted[1]["changes"]) == 1
    assert (change["number"], change["kind"], change["alarm"]) == ("bodies.carriage.viscous", "shift", True)
    assert change["from"].startswith("2025-03-10") and change["folder"].endswith("day-009")
    assert change["interval"][0] <= 0.25 <= change["interval"][1] or change["change"] == pytest.approx(0.25, abs=1e-3)
    assert change["probability"] > 0.99


def test_table_holds_every_estimate(fitted: Fitted) -> None:
    rows = [row for row in table.read(fitted[0]) if row["name"] == "bodies.carriage.viscous"]
    assert len(rows) == 16 and all(row["low"] <= row["value"] <= row["high"] for row in rows)
    assert rows[0]["value"] == pytest.approx(VISCOUS, rel=0.01) and rows[0]["unit"] == "N*s/m"
    assert rows[-1]["value"] == pytest.approx(1.25 * VISCOUS, rel=0.01) and rows[-1]["nominal"] == VISCOUS


def test_page_names_the_changed_parameter(fitted: Fitted) -> None:
    text = (fitted[0] / trend.PAGE).read_text("utf-8")
    assert "Changed: rail." in text and "bodies.carriage.viscous" in text and "<svg" in text and "+25 %" in text


def test_second_run_fits_only_new_recordings(fitted: Fitted, recordings: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trend, "estimates", lambda pieces: pytest.fail("fitted again"))
    again = trend.run([recordings], fitted[0])
    assert again["fitted"] == 0 and again["changes"] == fitted[1]["changes"]


def test_dask_workers_and_local_processes_give_equal_estimates(recordings: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask (distributed) is not installed")
    pieces = [piece for day in range(3) for piece in pieces_of(recordings / f"day-{day:03d}")]
    here = {
        piece: rows
        for batch, found in trend.computed(pieces, 1, None)
        for piece, rows in zip(batch, found, strict=True)
    }
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        there = list(trend.computed(pieces, 1, cluster.scheduler_address))
        assert {piece: rows for batch, found in there for piece, rows in zip(batch, found, strict=True)} == here
        away = [pieces[0]._replace(folder=str(tmp_path / "elsewhere"))]
        with pytest.raises(UserError, match="does not see"):
            list(trend.computed(away, 1, cluster.scheduler_address))


def test_unreadable_recording_is_reported_and_the_others_are_fitted(recordings: Path, tmp_path: Path) -> None:
    bad = bundle(tmp_path / "mixed" / "still", 0)
    (bad / "recording.parquet").write_bytes(b"no parquet")
    bundle(tmp_path / "mixed" / "good", 1)
    found = trend.run([tmp_path / "mixed"], tmp_path / "out")
    assert [Path(e["folder"]).name for e in found["errors"]] == ["still"] and found["looked_at"] == 3


def test_trend_without_a_readable_recording_has_no_answer(tmp_path: Path) -> None:
    bad = bundle(tmp_path / "mixed" / "still", 0)
    (bad / "recording.parquet").write_bytes(b"no parquet")
    with pytest.raises(NoAnswer, match="none of 1 recordings"):
        trend.run([tmp_path / "mixed"], tmp_path / "out")
