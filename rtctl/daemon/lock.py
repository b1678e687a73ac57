"""Lock file of a machine: at most one daemon runs it. The kernel releases the lock when its holder ends.

So no lock is stale, however its holder died. The pid in the file is for people only; the program does not use it to
decide who holds the lock.
"""

import fcntl
import os
import pwd
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError


class MachineLock:
    """Lock held while a daemon runs; `sockets` is the folder of its sockets, written to the file for people.

    Raises UserError where another daemon holds the lock, or where the file cannot be opened or locked.
    """

    def __init__(self, path: Path, name: str, sockets: Path | None = None):
        self._path, self._name, self._sockets, self._fd = path, name, sockets, -1

    def __enter__(self) -> "MachineLock":
        while True:
            self._fd = self._open()
            try:
                self._take()
                if self._in_place():
                    self._sign()
                    return self
            except BaseException:
                self._close()
                raise
            self._close()  # the last holder removed the file between open and lock: try again

    def __exit__(self, *_: Any) -> None:
        if self._in_place():  # removed while it is held: a file left behind could not be opened by another user
            self._path.unlink(missing_ok=True)
        self._close()

    def _open(self) -> int:
        try:
            return os.open(self._path, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
        except OSError as error:
            owner = _owner(self._path)
            hint = (
                f"it belongs to {owner}, who runs '{self._name}' or was killed doing so: have {owner} stop it, then "
                "remove the file"
                if isinstance(error, PermissionError) and owner
                else "the folder must exist and be writable by whoever runs the daemon; XDG_RUNTIME_DIR names another"
            )
            raise UserError(f"{self._path}: no lock for '{self._name}': {error.strerror}; {hint}") from None

    def _take(self) -> None:
        try:
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            pid, _, sockets = os.read(self._fd, 4096).decode(errors="replace").strip().partition("\n")
            pid = pid or "unknown"
            if pid.isdecimal() and not Path("/proc", pid).exists():
                pid += ", in another container"
            where = f", its sockets are in {sockets}" if sockets else ""
            raise UserError(
                f"'{self._name}' is run by another daemon (pid {pid}{where}); "
                f"stop it with `rtctl stop --name {self._name}`, or give this config another `name`"
            ) from None
        except OSError as error:
            raise UserError(
                f"{self._path}: this file system locks no files ({error.strerror}); set XDG_RUNTIME_DIR to another"
            ) from None

    def _sign(self) -> None:
        """Write pid and folder of sockets for people. Raises OSError where the disk is full."""
        os.ftruncate(self._fd, 0)
        os.write(self._fd, (f"{os.getpid()}\n" + (f"{self._sockets}\n" if self._sockets else "")).encode())

    def _in_place(self) -> bool:
        """Whether the open file is still the file at its path."""
        try:
            there = self._path.lstat()
        except OSError:
            return False
        return os.path.samestat(os.fstat(self._fd), there)

    def _close(self) -> None:
        os.close(self._fd)
        self._fd = -1


def _owner(path: Path) -> str | None:
    """User name of a file's owner, else its uid as text; None where the file cannot be read."""
    try:
        uid = path.lstat().st_uid
    except OSError:
        return None
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return f"uid {uid}"
