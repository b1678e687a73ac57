"""Writers replace a link and never write through it; readers stay in their folder."""

import os
from pathlib import Path

import pytest

from rtctl.config import files
from rtctl.config.errors import UserError


def test_link_in_place_of_the_target_is_replaced(tmp_path: Path) -> None:
    victim, target = tmp_path / "victim", tmp_path / "case.json"
    victim.write_text("mine")
    target.symlink_to(victim)
    files.write_text(target, "new", sync=True)
    assert victim.read_text() == "mine" and target.read_text() == "new" and not target.is_symlink()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["case.json", "victim"]


@pytest.mark.parametrize("append", [0, os.O_APPEND])
def test_stream_refuses_links_and_fifos(tmp_path: Path, append: int) -> None:
    victim = tmp_path / "victim"
    victim.write_text("mine")
    (tmp_path / "link").symlink_to(victim)
    (tmp_path / "hard").hardlink_to(victim)
    os.mkfifo(tmp_path / "fifo")
    for name in ("link", "hard", "fifo"):
        with pytest.raises(OSError):
            files.open_stream(tmp_path / name, append)
    assert victim.read_text() == "mine"


def test_reader_refuses_links_out_of_the_folder_and_fifos(tmp_path: Path) -> None:
    folder = tmp_path / "bundle"
    folder.mkdir()
    (tmp_path / "secret").write_text("x")
    (folder / "case.json").symlink_to(tmp_path / "secret")
    os.mkfifo(folder / "orders.jsonl")
    for name in ("case.json", "orders.jsonl"):
        with pytest.raises(UserError):
            files.inside(folder / name, folder)
