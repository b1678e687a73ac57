"""One daemon a machine: a lock file with the pid of who holds it. The kernel drops the lock with its holder."""

import fcntl
import os
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError


class MachineLock:
    """Held while a daemon runs. Raises UserError where another one does; a stale file is taken over silently."""

    def __init__(self, path: Path, name: str):
        self._path, self._name, self._fd = path, name, -1

    def __enter__(self) -> "MachineLock":
        self._fd = os.open(self._path, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            pid = os.read(self._fd, 32).decode(errors="replace").strip() or "unknown"
            os.close(self._fd)
            raise UserError(
                f"'{self._name}' is run by another daemon (pid {pid}); stop it with `rtctl stop --name {self._name}`, "
                "or give this config another `name`"
            ) from None
        os.ftruncate(self._fd, 0)
        os.write(self._fd, f"{os.getpid()}\n".encode())
        return self

    def __exit__(self, *_: Any) -> None:
        os.ftruncate(self._fd, 0)
        os.close(self._fd)
