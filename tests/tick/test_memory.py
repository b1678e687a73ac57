import mmap
from pathlib import Path

import numpy as np
import pytest

from rtctl.tick.memory import ALIGN, Segment

RECORD = np.dtype([("n", np.int64), ("x", np.float64, (3,))])
LAYOUT = {"first": (np.dtype(np.int8), 3), "records": (RECORD, 5)}


def test_segment_starts_zeroed_with_each_array_on_a_separate_cache_line(tmp_path: Path) -> None:
    segment = Segment.create(tmp_path / "new" / "s", LAYOUT)
    assert not segment["first"].any() and not segment["records"]["x"].any()
    apart = segment["records"].ctypes.data - segment["first"].ctypes.data
    assert apart == ALIGN and segment["first"].ctypes.data % mmap.PAGESIZE == 0


def test_two_maps_of_a_segment_share_data(tmp_path: Path) -> None:
    a = Segment.create(tmp_path / "s", LAYOUT)
    b = Segment.open(tmp_path / "s", LAYOUT)
    a["records"][4]["x"][2] = 7.5
    b["first"][1] = -3
    assert b["records"][4]["x"][2] == 7.5 and a["first"][1] == -3


def test_open_map_outlives_its_file(tmp_path: Path) -> None:
    a = Segment.create(tmp_path / "s", LAYOUT)
    b = Segment.open(tmp_path / "s", LAYOUT)
    a.unlink()
    a.unlink()
    a["first"][0] = 1
    assert b["first"][0] == 1
    with pytest.raises(FileNotFoundError):
        Segment.open(tmp_path / "s", LAYOUT)


def test_existing_segment_is_never_replaced(tmp_path: Path) -> None:
    live = Segment.create(tmp_path / "s", LAYOUT)
    with pytest.raises(FileExistsError):
        Segment.create(tmp_path / "s", LAYOUT)
    live["first"][0] = 9
    assert Segment.open(tmp_path / "s", LAYOUT)["first"][0] == 9


def test_layout_of_another_size_is_refused_with_both_sizes(tmp_path: Path) -> None:
    Segment.create(tmp_path / "s", LAYOUT)
    with pytest.raises(ValueError, match=r"s: 256 bytes, but this config needs 704; it is of another version"):
        Segment.open(tmp_path / "s", {**LAYOUT, "records": (RECORD, 20)})


def test_segment_is_readable_by_its_owner_only(tmp_path: Path) -> None:
    Segment.create(tmp_path / "s", LAYOUT)
    assert (tmp_path / "s").stat().st_mode & 0o077 == 0
