"""Cache folder of rtctl: compiled ticks, and the words that the shell completes.

Compiled steps are pickles and generated ticks are modules: whoever can write to the folder decides what rtctl runs. So
the folder must belong to this user, or to root for reading, and others must not write to it.
"""

import os
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

import platformdirs

from rtctl.config.errors import UserError
from rtctl.config.private import COMPILED, check, made

NUMBA = "NUMBA_CACHE_DIR"
SETTINGS = ".numba_config.yaml"  # numba reads this file from the current folder


def cache_folder() -> Path:
    """Cache folder: $RTCTL_CACHE_DIR, or the user's cache folder; never the program's folder, which may be read-only.

    Raises UserError for a folder of another user, a folder that others may write, and a home that does not exist.
    """
    given = os.environ.get("RTCTL_CACHE_DIR")
    return _checked(Path(given) if given else Path(platformdirs.user_cache_dir("rtctl")), os.geteuid())


def check_compiled(folder: Path) -> None:
    """Check the machine code of the modules in `folder`. Raises UserError where others may have written it.

    Called before numba loads the code. numba makes folders with the user's umask, so the folder is made here.
    """
    with suppress(OSError):  # a read-only folder that its owner shares
        made(folder / "__pycache__")
    check(folder / "__pycache__")
    check_numba()


def check_numba() -> None:
    """Check where numba reads settings and machine code from. Raises UserError where others may write there."""
    if Path(SETTINGS).is_file():
        raise UserError(
            f"{Path(SETTINGS).absolute()} would say how numba compiles and whose machine code is run; run rtctl in "
            "another folder, and give settings of numba as variables (NUMBA_...)"
        )
    given = os.environ.get(NUMBA)
    if given:
        for folder in (Path(given), *(path for path in Path(given).glob("*") if path.is_dir())):
            check(folder, COMPILED)


@lru_cache(maxsize=8)
def _checked(folder: Path, user: int) -> Path:
    home = Path.home()
    if folder.is_relative_to(home) and not home.exists():
        raise UserError(f"{folder}: the home folder {home} does not exist; set RTCTL_CACHE_DIR to a folder of yours")
    check(folder)
    return folder
