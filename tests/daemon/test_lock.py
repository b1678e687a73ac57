"""Lock file of a machine: its holder, and the lock of a killed holder."""

import errno
import os
import pwd
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from rtctl.config.errors import UserError
from rtctl.daemon import lock
from rtctl.daemon.lock import MachineLock

HOLD = """
import sys, time
from pathlib import Path
from rtctl.daemon.lock import MachineLock
with MachineLock(Path(sys.argv[1]), "ivu"):
    print("held", flush=True)
    sys.stdin.read()
"""


def holder(path: Path) -> subprocess.Popen:
    """Another process that holds the lock until its standard input ends."""
    made = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert made.stdout is not None and made.stdout.readline() == "held\n"
    return made


def test_held_lock_file_contains_the_pid_and_is_removed_afterwards(tmp_path: Path) -> None:
    path = tmp_path / "ivu.lock"
    with MachineLock(path, "ivu"):
        assert path.read_text() == f"{os.getpid()}\n" and path.stat().st_mode & 0o777 == 0o600
    assert not path.exists()


def test_lock_is_released_when_a_full_disk_prevents_writing_the_pid(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    path = tmp_path / "ivu.lock"
    with monkeypatch.context() as patch:
        patch.setattr(os, "ftruncate", full)
        with pytest.raises(OSError, match="No space"):
            MachineLock(path, "ivu").__enter__()
    with MachineLock(path, "ivu"):
        assert path.read_text() == f"{os.getpid()}\n"


def test_second_holder_is_refused_with_the_pid_of_the_first(tmp_path: Path) -> None:
    path = tmp_path / "ivu.lock"
    with holder(path) as first:
        for _ in range(2):
            with pytest.raises(UserError, match=rf"'ivu' is run by another daemon \(pid {first.pid}\)"):
                MachineLock(path, "ivu").__enter__()
        first.communicate("")
    with MachineLock(path, "ivu"):
        pass


def test_lock_of_a_killed_holder_is_free(tmp_path: Path) -> None:
    path = tmp_path / "ivu.lock"
    with holder(path) as first:
        first.send_signal(signal.SIGKILL)
    assert path.read_text() == f"{first.pid}\n"
    with MachineLock(path, "ivu"):
        assert path.read_text() == f"{os.getpid()}\n"


def test_reused_pid_in_the_lock_file_does_not_block_the_lock(tmp_path: Path) -> None:
    path = tmp_path / "ivu.lock"
    path.write_text(f"{os.getppid()}\n")  # pid of a live process that does not hold the lock
    with MachineLock(path, "ivu"):
        assert path.read_text() == f"{os.getpid()}\n"


def test_longer_old_content_of_the_lock_file_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "ivu.lock"
    path.write_text("1234567890 and more\n")
    with MachineLock(path, "ivu"):
        assert path.read_text() == f"{os.getpid()}\n"


def test_lock_file_removed_between_opening_and_locking_is_created_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise two daemons could each hold a lock: one on the removed file, one on the new file."""
    path = tmp_path / "ivu.lock"
    real, removed = lock.fcntl.flock, []

    def late(fd: int, how: int) -> None:
        if not removed:
            removed.append(path.stat().st_ino)
            path.rename(tmp_path / "gone")
        real(fd, how)

    monkeypatch.setattr(lock.fcntl, "flock", late)
    with MachineLock(path, "ivu"):
        assert path.stat().st_ino != removed[0]
        with pytest.raises(UserError, match="run by another daemon"):
            MachineLock(path, "ivu").__enter__()


def test_release_does_not_remove_the_lock_file_of_another_holder(tmp_path: Path) -> None:
    path = tmp_path / "ivu.lock"
    with MachineLock(path, "ivu"):
        path.unlink()
        path.write_text("another\n")
    assert path.read_text() == "another\n"


@pytest.mark.parametrize("trap", ["folder", "link", "no folder"])
def test_path_that_cannot_be_a_lock_file_is_an_error(tmp_path: Path, trap: str) -> None:
    path = tmp_path / "ivu.lock"
    if trap == "folder":
        path.mkdir()
    elif trap == "link":
        path.symlink_to(tmp_path / "elsewhere")
    else:
        path = tmp_path / "none" / "ivu.lock"
    with pytest.raises(UserError, match=r"ivu\.lock: no lock for 'ivu': .*; the folder must exist and be writable"):
        MachineLock(path, "ivu").__enter__()
    assert not (tmp_path / "elsewhere").exists()


def test_file_system_without_locks_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(fd: int, how: int) -> None:
        raise OSError(37, "No locks available")

    monkeypatch.setattr(lock.fcntl, "flock", none)
    with pytest.raises(UserError, match="this file system locks no files"):
        MachineLock(tmp_path / "ivu.lock", "ivu").__enter__()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
@pytest.mark.parametrize("trap", ["read-only folder", "file of root"])
def test_lock_error_for_another_user_names_the_owner(runtime: Path, trap: str) -> None:
    nobody = pwd.getpwnam("nobody").pw_uid
    folder = runtime / trap.replace(" ", "-")
    folder.mkdir()
    path = folder / "ivu.lock"
    if trap == "file of root":
        path.write_text("1\n")
        path.chmod(0o600)
        folder.chmod(0o777)
    said = as_user(nobody, runtime, path)
    assert "no lock for 'ivu': Permission denied" in said
    assert ("it belongs to root" if trap == "file of root" else "the folder must exist and be writable") in said


def as_user(uid: int, runtime: Path, path: Path) -> str:
    """Message of MachineLock in a forked process of another user; the imports precede the change of user."""
    mode = runtime.stat().st_mode
    runtime.chmod(0o755)
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.setgroups([])
            os.setgid(65534)
            os.setuid(uid)
            MachineLock(path, "ivu").__enter__()
        except UserError as error:
            os.write(write, str(error).encode())
        finally:
            os._exit(0)
    os.close(write)
    os.waitpid(child, 0)
    runtime.chmod(mode)
    with os.fdopen(read) as out:
        return out.read()
