"""Private folders: owned by this user or root and not writable by others, so that their files can be trusted.

A group with this user as its only member (Debian, Fedora: `umask 002`) counts as the user.
"""

import grp
import os
import pwd
import stat
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from rtctl.config.errors import UserError


class Use(NamedTuple):
    """Purpose of a folder, for messages."""

    what: str  # "cache folder"
    danger: str  # what another user could do, "what lies there would be run"
    variable: str  # environment variable that names another folder


CACHE = Use("cache folder", "what lies there would be run", "RTCTL_CACHE_DIR")
COMPILED = Use("cache folder of numba", "what lies there would be run", "NUMBA_CACHE_DIR")
SOCKETS = Use("folder for sockets", "whoever writes there could answer for a machine", "XDG_RUNTIME_DIR")


def check(folder: Path, use: Use = CACHE) -> None:
    """Raise UserError where another user could put files into a folder.

    Root may own the folder and any folder above it. A folder above that others may write needs the sticky bit. Where
    the user's private group may write to a folder of this user, that right is removed.
    """
    folder = folder.absolute()
    for path in (folder, *folder.parents):
        try:
            found = path.lstat()
        except OSError:
            continue  # not there yet
        where = f"{use.what} {folder}" if path == folder else f"{path}, above the {use.what} {folder},"
        if found.st_uid not in (os.geteuid(), 0):
            raise UserError(
                f"{where} belongs to user {found.st_uid}, not to this user ({os.geteuid()}), and {use.danger}; "
                f"set {use.variable} to a folder of yours"
            )
        if stat.S_ISLNK(found.st_mode):
            if path == folder:
                check(folder.resolve(), use)
                return
            continue
        sticky = path != folder and found.st_mode & stat.S_ISVTX
        if not _open(found) or sticky:
            continue
        raise UserError(
            f"{where} may be written by others (mode {stat.S_IMODE(found.st_mode):04o}), and {use.danger}; "
            f"run: chmod go-w {path}, or set {use.variable} to a folder of yours"
        )
    _close(folder)


def made(folder: Path, use: Use = CACHE) -> Path:
    """The folder, made with mode 0700 if it is missing, whatever the umask. Raises OSError, UserError as `check`."""
    missing = [p for p in (folder, *folder.parents) if not p.exists()]
    for path in reversed(missing):
        path.mkdir(mode=0o700, exist_ok=True)
    check(folder, use)
    return folder


def _open(found: os.stat_result) -> bool:
    """Whether others may write to a folder, seen from its owner, mode and group."""
    if found.st_mode & stat.S_IWOTH:
        return True
    return bool(found.st_mode & stat.S_IWGRP) and not _is_private(found.st_gid)


def _close(folder: Path) -> None:
    """Remove the group's right to write from a folder of this user."""
    with suppress(OSError):  # not there yet, or a file system without modes
        found = folder.lstat()
        if stat.S_ISDIR(found.st_mode) and found.st_uid == os.geteuid() and found.st_mode & stat.S_IWGRP:
            folder.chmod(stat.S_IMODE(found.st_mode) & ~stat.S_IWGRP)


def _is_private(number: int) -> bool:
    """Whether a group is of this user alone: it has the user's name and no other member, also by primary group."""
    try:
        group, user = grp.getgrgid(number), pwd.getpwuid(os.geteuid())
    except KeyError:
        return False
    others = (one for one in pwd.getpwall() if one.pw_gid == number and one.pw_uid != user.pw_uid)
    return group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name} and next(others, None) is None
