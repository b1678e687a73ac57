"""Python processes of rtctl that import nothing from the current folder, whatever lies there.

The flag -P leaves the current folder out of the path of imports. A folder in PYTHONPATH, a user's site and an editable
installation still count, which -I would leave out.
"""

import os
import sys


def python(*words: str) -> list[str]:
    """Command of a Python process, e.g. python("-m", "rtctl.daemon.loop_process")."""
    return [sys.executable, "-P", *words]


def isolate() -> None:
    """Let processes that multiprocessing starts leave the current folder out too, and this one from here on."""
    os.environ["PYTHONSAFEPATH"] = "1"
    here = os.path.realpath(os.getcwd()) if os.path.isdir(".") else None  # noqa: PTH109, PTH112
    given = {os.path.realpath(word) for word in os.environ.get("PYTHONPATH", "").split(os.pathsep) if word}
    sys.path[:] = [p for p in sys.path if p and not (p == here and here not in given)]
