"""Pieces of recordings: windows of a long recording, read without the other row groups."""

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from rtctl.config.errors import UserError
from rtctl.trace.bundle import load_bundle
from rtctl.trend.pieces import bundles_in, pieces_of, read
from tests.trend.bundles import BEGAN, bundle


def test_windows_of_a_long_recording_read_only_their_row_groups(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = bundle(tmp_path / "long", 3, 20.0, row_group=1000)
    pieces = pieces_of(folder, 6.0)
    assert [piece.rows for piece in pieces] == [3334, 3334, 3332]
    assert pieces[1].at == pytest.approx(BEGAN.timestamp() + 3 * 86400 + pieces[1].begin)
    asked: list[int] = []
    whole = pq.ParquetFile.read_row_group
    monkeypatch.setattr(pq.ParquetFile, "read_row_group", lambda self, k: (asked.append(k), whole(self, k))[1])
    x = np.concatenate([read(piece).columns["x"] for piece in pieces])
    assert asked == [0, 1, 2, 3, 3, 4, 5, 6, 6, 7, 8, 9]
    assert np.array_equal(x, load_bundle(folder).columns["x"])


def test_short_remainder_joins_the_last_window(tmp_path: Path) -> None:
    folder = bundle(tmp_path / "one", 0, 4.0)
    assert len(pieces_of(folder, 3.0)) == 1 and len(pieces_of(folder, 2.0)) == 2


def test_machine_name_is_the_group_or_the_folder(tmp_path: Path) -> None:
    assert pieces_of(bundle(tmp_path / "bench" / "a", 0))[0].machine == "rail"
    assert pieces_of(bundle(tmp_path / "bench" / "b", 0, group=""))[0].machine == "bench"


def test_changed_recording_has_a_new_stamp(tmp_path: Path) -> None:
    folder = bundle(tmp_path / "a", 0)
    before = pieces_of(folder)[0].stamp
    (folder / "case.json").write_text((folder / "case.json").read_text() + "\n")
    assert pieces_of(folder)[0].stamp != before


def test_bundles_are_found_at_any_depth_and_missing_bundles_are_refused(tmp_path: Path) -> None:
    one, two = bundle(tmp_path / "x" / "b", 0), bundle(tmp_path / "x" / "deep" / "a", 1)
    assert bundles_in([tmp_path / "x", one]) == [one, two]
    with pytest.raises(UserError, match="holds no bundle"):
        (tmp_path / "empty").mkdir()
        bundles_in([tmp_path / "empty"])
    with pytest.raises(UserError, match="is not a folder"):
        bundles_in([tmp_path / "nowhere"])
