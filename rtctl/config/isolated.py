"""Python processes of rtctl that import nothing from the current folder.

The flag -P leaves the current folder out of the import path. A folder in PYTHONPATH, a user's site and an editable
installation still count; -I would leave them out. This module imports only modules that the interpreter has loaded.
"""

import os
import sys


def python(*words: str) -> list[str]:
    """Command of a Python process, e.g. python("-m", "rtctl.daemon.loop_process")."""
    return [sys.executable, "-P", *words]


def isolate() -> None:
    """Remove the current folder from the import path of this process and of those that multiprocessing starts.

    `python -m` and `python -c` put the current folder first; a folder that PYTHONPATH or an installation names stays.
    """
    os.environ["PYTHONSAFEPATH"] = "1"
    os.environ.setdefault("NUMBA_CACHE_DIR", "")  # else .numba_config.yaml of the current folder may name one
    sys.path[:] = [folder for folder in sys.path if folder]
    if not sys.flags.safe_path and sys.path and sys.path[0] == _here() and not _is_given(sys.path[0]):
        del sys.path[0]


def _here() -> str | None:
    """The current folder; None where it is gone."""
    try:
        return os.getcwd()  # noqa: PTH109
    except OSError:
        return None


def _is_given(folder: str) -> bool:
    return folder in os.environ.get("PYTHONPATH", "").split(os.pathsep)
