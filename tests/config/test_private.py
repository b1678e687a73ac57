"""A folder writable by others is refused; a group of this user alone counts as this user."""

import grp
import os
import pwd
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from rtctl.config import cache, private
from rtctl.config.errors import UserError
from rtctl.daemon.server import runtime_dir


@pytest.fixture
def umask() -> Iterator[None]:
    """Default umask of Debian and Fedora."""
    before = os.umask(0o002)
    yield
    os.umask(before)


@pytest.fixture
def grouped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """`grouped("user", [])`: a folder of mode 0775 whose group has this name and these further members."""

    def make(name: str, members: list[str]) -> Path:
        folder = tmp_path / "cache"
        folder.mkdir(mode=0o700)
        folder.chmod(0o775)
        user = pwd.getpwuid(os.geteuid())
        alone = pwd.struct_passwd(("user", "x", user.pw_uid, folder.stat().st_gid, "", "/", "/bin/sh"))
        monkeypatch.setattr(pwd, "getpwuid", lambda _: alone)
        monkeypatch.setattr(pwd, "getpwall", lambda: [alone])
        monkeypatch.setattr(grp, "getgrgid", lambda _: SimpleNamespace(gr_name=name, gr_mem=members))
        return folder

    return make


def test_folder_of_a_private_group_is_accepted_and_made_private(grouped: Callable[..., Path]) -> None:
    folder = grouped("user", [])
    below = folder / "steps"
    below.mkdir()
    private.check(below)  # parent folders are unchanged
    assert folder.stat().st_mode & 0o777 == 0o775
    private.check(folder)
    assert folder.stat().st_mode & 0o777 == 0o755


@pytest.mark.parametrize(("name", "members"), [("user", ["other"]), ("users", [])])
def test_folder_of_a_shared_group_is_refused(grouped: Callable[..., Path], name: str, members: list[str]) -> None:
    folder = grouped(name, members)
    with pytest.raises(UserError, match="may be written by others"):
        private.check(folder)
    with pytest.raises(UserError, match="above the cache folder"):
        private.check(folder / "steps")
    assert folder.stat().st_mode & 0o777 == 0o775


def test_folder_writable_by_others_is_refused_for_any_group(grouped: Callable[..., Path]) -> None:
    folder = grouped("user", [])
    folder.chmod(0o777)
    with pytest.raises(UserError, match="chmod go-w"):
        private.check(folder)


@pytest.mark.usefixtures("umask")
def test_new_folders_are_private(tmp_path: Path) -> None:
    made = private.made(tmp_path / "a" / "b")
    assert {path.stat().st_mode & 0o777 for path in (made, made.parent)} == {0o700}
    cache.check_compiled(made)  # otherwise numba creates it with the umask, and the next start refuses it
    assert (made / "__pycache__").stat().st_mode & 0o777 == 0o700


def test_numba_cache_in_a_folder_of_others_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    (tmp_path / "made_1").mkdir()
    cache.check_numba()
    (tmp_path / "made_1").chmod(0o777)
    with pytest.raises(UserError, match="set NUMBA_CACHE_DIR to a folder of yours"):
        cache.check_compiled(tmp_path)


def test_numba_settings_in_the_current_folder_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / cache.SETTINGS).write_text("cache_dir: /\n")
    with pytest.raises(UserError, match="run rtctl in another folder"):
        cache.check_numba()


def test_socket_folder_of_others_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    runtime_dir().chmod(0o777)
    with pytest.raises(UserError, match="set XDG_RUNTIME_DIR to a folder of yours"):
        runtime_dir()
