"""Renamed, moved or deleted open files: present path of an open file, and copy of a deleted file.

write(2) continues after the folder was renamed, moved or deleted. Without a check of the name, rows go into a file that
nobody finds.
"""

import os
import shutil
import stat
from pathlib import Path


def in_place(fd: int, path: Path) -> bool:
    """Whether `path` still names the open file or folder. Always True for a pipe or a device."""
    found = os.fstat(fd)
    if not stat.S_ISREG(found.st_mode) and not stat.S_ISDIR(found.st_mode):
        return True
    try:
        return os.path.samestat(found, path.lstat())
    except OSError:
        return False


def place(fd: int) -> Path | None:
    """Present path of an open file or folder; None where it was deleted or is not found."""
    try:
        path = Path(os.readlink(f"/proc/self/fd/{fd}"))  # noqa: PTH115
    except OSError:
        return None
    return path if in_place(fd, path) else None


def copied(fd: int, path: Path) -> int:
    """Descriptor of a new file at `path` with all bytes of an open, possibly deleted file. Raises OSError."""
    new = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o644)
    try:
        with Path(f"/proc/self/fd/{fd}").open("rb") as old, os.fdopen(os.dup(new), "wb") as file:
            shutil.copyfileobj(old, file, 1 << 20)
        os.fsync(new)
    except BaseException:
        os.close(new)
        path.unlink(missing_ok=True)
        raise
    return new


def beside(folder: Path) -> Path:
    """Free folder name `NAME-rescued` beside a deleted folder."""
    base = folder.with_name(f"{folder.name}-rescued")
    found, number = base, 2
    while os.path.lexists(found):
        found, number = base.with_name(f"{base.name}-{number}"), number + 1
    return found
