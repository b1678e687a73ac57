"""A recording is scored in pieces, like live rows."""

import json

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.watch.kept import identity, save_band
from rtctl.watch.monitor import Monitor
from rtctl.watch.recorded import PIECE, rows_of, watch_bundle


@pytest.fixture
def bundle(rehearsed, tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    rows = rehearsed.after
    pq.write_table(pa.table({name: rows[name] for name in rows.dtype.names}), folder / "recording.parquet")
    (folder / "case.json").write_text(json.dumps(rehearsed.case, default=str))
    return folder


def test_recording_is_read_completely_in_bounded_pieces(rehearsed, bundle):
    pieces = list(rows_of(bundle))
    assert max(len(piece) for piece in pieces) <= PIECE
    assert sum(len(piece) for piece in pieces) == len(rehearsed.after)
    assert pieces[0].dtype.names == rehearsed.after.dtype.names


def test_healthy_recording_raises_no_alarm(rehearsed, bundle, tmp_path):
    band, said = tmp_path / "band.json", []
    save_band(band, rehearsed.band, identity(rehearsed.case, None))
    assert watch_bundle(bundle, said.append, band=band) == []
    live = Monitor(rehearsed.case, band=rehearsed.band)
    live.feed(rehearsed.after)
    assert said[-1].startswith(f"{live.judged} windows judged")


def test_recording_too_short_for_learning_is_refused(bundle, tmp_path):
    with pytest.raises(NoAnswer, match="ends before the band is learned"):
        watch_bundle(bundle, lambda _: None, seconds=3600.0)
    with pytest.raises(UserError, match="nowhere"):
        watch_bundle(tmp_path / "nowhere", lambda _: None)
