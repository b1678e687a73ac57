"""Folder of a user's shared memory, mode 0700, below /dev/shm: segment, lock and description of each machine.

Its path depends only on the user, not on XDG_RUNTIME_DIR, so that one machine has one lock and one segment.
A segment outlives a killed daemon. The next start renames the segment and the description of its rows.
"""

import errno
import json
import os
import pwd
import stat
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.config.files import write_text
from rtctl.daemon import tap
from rtctl.tick.memory import Segment

SHM = Path("/dev/shm")
VARIABLE = "RTCTL_SHM_DIR"
KEPT = 3  # segments of killed daemons kept for each machine; the oldest goes first
SEGMENT, ABOUT, LOCK = ".segment", ".json", ".lock"


def shared_folder() -> Path:
    """Private folder of this user, made if missing: $RTCTL_SHM_DIR or /dev/shm/rtctl-UID.

    Raises UserError where it cannot be made, is a link, belongs to another user, or may be entered by others.
    """
    given = os.environ.get(VARIABLE)
    folder = Path(given) if given else SHM / f"rtctl-{os.geteuid()}"
    way_on = f"set {VARIABLE} to a private folder of yours (mode 0700), best on a tmpfs such as $XDG_RUNTIME_DIR/shm"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except FileExistsError:
        pass  # a file: refused below
    except OSError as error:
        raise UserError(f"{folder}: no folder for shared memory here: {error.strerror}; {way_on}") from None
    found = folder.lstat()
    if found.st_uid != os.geteuid():
        raise UserError(f"{folder} belongs to {_user(found.st_uid)}, not to {_user(os.geteuid())}; {way_on}")
    if not stat.S_ISDIR(found.st_mode):
        raise UserError(f"{folder} is not a folder; remove it, or {way_on}")
    if found.st_mode & 0o077:
        raise UserError(f"{folder} may be entered by others (mode {found.st_mode & 0o777:04o}); `chmod 700 {folder}`")
    return folder


def segment_path(name: str) -> Path:
    """Path of the shared memory of a machine of this user."""
    return shared_folder() / f"{name}{SEGMENT}"


def lock_path(name: str) -> Path:
    """Path of the lock of a machine of this user."""
    return shared_folder() / f"{name}{LOCK}"


def create(path: Path, shape: dict[str, tuple[np.dtype, int]]) -> Segment:
    """New segment with all its memory allocated. Raises UserError where there is not enough shared memory."""
    try:
        return Segment.create(path, shape)
    except OSError as error:
        room = os.statvfs(path.parent)
        need = sum(dtype.itemsize * count for dtype, count in shape.values())
        if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.ENOMEM):
            raise UserError(f"{path}: no shared memory: {error.strerror}") from None
        raise UserError(
            f"{path}: the ring needs {need / 1e6:.1f} MB of shared memory, {room.f_bavail * room.f_frsize / 1e6:.1f} MB"
            f" are free in {path.parent}; make room there (docker: --shm-size), or give a smaller record.seconds"
        ) from None


def describe(segment: Segment, columns: Any, case: dict[str, Any], out: Path | None) -> Path:
    """Write the description of a segment beside it: layout of its rows, columns, case and bundle. Returns its path."""
    path = segment.path.with_suffix(ABOUT)
    row = segment["rows"].dtype
    about = {
        **tap.describe(segment),
        "offsets": [row.fields[name][1] for name in row.names],
        "itemsize": row.itemsize,
        "loop": {name: segment["status"].dtype.fields[name][1] for name in ("pid", "ended")},  # first in a segment
        "columns": [[c.name, c.unit, c.help] for c in columns],
        "case": case,
        "bundle": None if out is None else str(out.absolute()),
    }
    write_text(path, json.dumps(about, default=_plain))
    return path


def remove(path: Path) -> None:
    """Remove a segment and its description."""
    path.unlink(missing_ok=True)
    path.with_suffix(ABOUT).unlink(missing_ok=True)


def put_aside(name: str, most: int | None = KEPT) -> Path | None:
    """Rename the segment of a killed daemon; call with the machine's lock held. Returns the new path, or None.

    At most `most` segments of a machine are kept, None for all. A segment without description cannot be read and is
    removed.
    """
    path = segment_path(name)
    if not path.exists():
        remove(path)
        return None
    if not path.with_suffix(ABOUT).exists():
        remove(path)
        return None
    when = datetime.fromtimestamp(path.stat().st_mtime).strftime("%Y%m%d-%H%M%S")
    target = path.with_name(f"{name}@{when}-{path.stat().st_ino}{SEGMENT}")
    path.with_suffix(ABOUT).rename(target.with_suffix(ABOUT))
    path.rename(target)
    for old in [] if most is None else kept(name)[:-most]:
        remove(old)
    return target


def kept(name: str) -> list[Path]:
    """Segments of earlier daemons of this name, oldest first. No machine's name holds an @."""
    return sorted(shared_folder().glob(f"{name}@*{SEGMENT}"), key=lambda path: (path.stat().st_mtime, path.name))


def names() -> list[str]:
    """Names of this user's machines with a segment: running machines and killed ones."""
    return sorted({path.name.removesuffix(SEGMENT).partition("@")[0] for path in shared_folder().glob(f"*{SEGMENT}")})


def _user(uid: int) -> str:
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return f"uid {uid}"


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else str(value)
