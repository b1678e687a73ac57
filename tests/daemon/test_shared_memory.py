"""Folder of shared memory: its owner and mode, and the segments kept of killed runs."""

import os
import pwd
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.daemon import shared_memory
from rtctl.daemon.session import Session
from rtctl.daemon.supervisor import Supervisor
from rtctl.tick.memory import Segment

SHAPE = {"status": (np.dtype([("pid", np.int64), ("ended", np.int64)]), 1)}


@pytest.fixture
def shm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in place of /dev/shm."""
    monkeypatch.setattr(shared_memory, "SHM", tmp_path)
    monkeypatch.delenv(shared_memory.VARIABLE, raising=False)
    return tmp_path / f"rtctl-{os.geteuid()}"


def test_shared_memory_folder_is_private(shm: Path) -> None:
    assert shared_memory.shared_folder() == shm and shm.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("squat", ["file", "link", "open"])
def test_shared_memory_folder_that_is_not_private_is_refused(shm: Path, squat: str) -> None:
    if squat == "file":
        shm.touch()
    elif squat == "link":
        (shm.parent / "elsewhere").mkdir(mode=0o700)
        shm.symlink_to(shm.parent / "elsewhere")
    else:
        shm.mkdir()
        shm.chmod(0o770)
    with pytest.raises(UserError, match=r"is not a folder.*RTCTL_SHM_DIR|may be entered by others \(mode 0770\)"):
        shared_memory.segment_path("ivu")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_error_for_a_folder_of_another_user_names_the_remedy(shm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shm.mkdir(mode=0o700)
    os.chown(shm, pwd.getpwnam("nobody").pw_uid, -1)
    with pytest.raises(UserError, match="belongs to nobody, not to root; set RTCTL_SHM_DIR"):
        shared_memory.shared_folder()
    monkeypatch.setenv(shared_memory.VARIABLE, str(shm.parent / "mine"))
    assert shared_memory.shared_folder() == shm.parent / "mine"


def test_missing_shared_memory_is_an_error(shm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_memory, "SHM", shm / "missing")
    with pytest.raises(UserError, match="no folder for shared memory here: No such file"):
        shared_memory.shared_folder()


def test_too_little_shared_memory_is_an_error_at_the_start(shm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    path = shared_memory.segment_path("ivu")
    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(UserError, match=r"needs 0\.0 MB of shared memory.* are free in .*--shm-size"):
        shared_memory.create(path, SHAPE)
    assert not path.exists()


def test_number_of_kept_segments_is_limited_and_the_oldest_is_removed(shm: Path) -> None:
    for n in range(shared_memory.KEPT + 2):
        path = shared_memory.segment_path("ivu")
        Segment.create(path, SHAPE)
        os.utime(path, (1e9 + n, 1e9 + n))
        path.with_suffix(shared_memory.ABOUT).write_text("{}")
        assert shared_memory.put_aside("ivu") == shared_memory.kept("ivu")[-1]
    assert len(shared_memory.kept("ivu")) == shared_memory.KEPT
    assert shared_memory.kept("ivu")[0].stat().st_mtime == 1e9 + 2
    assert shared_memory.put_aside("ivu") is None


def test_machine_lock_does_not_depend_on_the_folder_of_sockets(
    runtime: Path, config: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A second start under another XDG_RUNTIME_DIR is refused and leaves the live segment unchanged."""
    settings = config()
    with Supervisor(settings, None, 50) as first:
        inode = first.segment.path.stat().st_ino
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
        with pytest.raises(UserError, match=rf"pid {os.getpid()}, its sockets are in {runtime}/rtctl"):
            Session(settings, None, 0.1).run()
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
        assert first.segment.path.stat().st_ino == inode
        for _ in first.run():
            pass
        assert first.snapshot()["ticks"] == 50
