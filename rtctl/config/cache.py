"""Where rtctl keeps what it can make again: compiled ticks, and the words that the shell completes.

Compiled steps are pickles and generated ticks are modules: who can write to the folder decides what rtctl runs. So the
folder has to be of this user, or of root to read from, and closed to others.
"""

import os
import stat
from functools import lru_cache
from pathlib import Path

import platformdirs

from rtctl.config.errors import UserError


def cache_folder() -> Path:
    """$RTCTL_CACHE_DIR, or the user's cache folder. Never the folder of the program, which may be read-only.

    Raises UserError for a folder that is not ours or that others may write, and for a home that does not exist.
    """
    given = os.environ.get("RTCTL_CACHE_DIR")
    return _checked(Path(given) if given else Path(platformdirs.user_cache_dir("rtctl")), os.geteuid())


def made(folder: Path) -> Path:
    """The folder, made where it is missing, of mode 0700. Raises OSError, UserError as `cache_folder`."""
    missing = [p for p in (folder, *folder.parents) if not p.exists()]
    for path in reversed(missing):
        path.mkdir(mode=0o700, exist_ok=True)
    check(folder)
    return folder


@lru_cache(maxsize=8)
def _checked(folder: Path, user: int) -> Path:
    home = Path.home()
    if folder.is_relative_to(home) and not home.exists():
        raise UserError(f"{folder}: the home folder {home} does not exist; set RTCTL_CACHE_DIR to a folder of yours")
    check(folder)
    return folder


def check(folder: Path) -> None:
    """Raise UserError where somebody else could put code into a folder that rtctl loads from.

    Root may own it, and any folder above it. A folder above that others may write needs the sticky bit.
    """
    folder = folder.absolute()
    for path in (folder, *folder.parents):
        try:
            found = path.lstat()
        except OSError:
            continue  # not there yet
        where = f"cache folder {folder}" if path == folder else f"{path}, above the cache folder {folder},"
        if found.st_uid not in (os.geteuid(), 0):
            raise UserError(
                f"{where} belongs to user {found.st_uid}, not to this user ({os.geteuid()}), and what lies there would "
                "be run; set RTCTL_CACHE_DIR to a folder of yours"
            )
        if stat.S_ISLNK(found.st_mode):
            if path == folder:
                check(folder.resolve())
                return
            continue
        sticky = path != folder and found.st_mode & stat.S_ISVTX
        if found.st_mode & 0o022 and not sticky:
            raise UserError(
                f"{where} may be written by others (mode {stat.S_IMODE(found.st_mode):04o}), and what lies there would "
                f"be run; run: chmod go-w {path}, or set RTCTL_CACHE_DIR to a folder of yours"
            )
