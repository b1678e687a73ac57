"""What compiled code is made of: the sources that a tick can come from, and the versions that turn them into it."""

import hashlib
import platform
import sys
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path

import numba
import numpy as np

from rtctl import __version__

# folders and files whose sources no tick can come from
NEVER_COMPILED = {
    "campaign", "cli", "daemon", "design", "diagnose", "doctor", "faults", "foxglove", "identify", "improve", "manual",
    "own", "proof", "reproduce", "scope", "soak", "terminal", "trace", "trend", "watch",
    "api.py", "api_bundles.py", "api_diagnosis.py", "api_improve.py", "board.py", "boards.py", "bus.py",
    "callable_module.py", "comedi.py", "emulated.py", "fmu.py", "fmu_file.py", "nidaqmx.py",
    "wiring.py", "profile.py", "profiles.py", "told.py", "own_check.py", "shown.py", "workers.py",
}  # fmt: skip


def files() -> Iterator[Path]:
    """Every source file that a tick can come from, in a fixed order."""
    import rtctl.drivers
    import rtctl.plants

    roots = [Path(__file__).parent, *map(Path, rtctl.plants.__path__), *map(Path, rtctl.drivers.__path__)]
    for root in roots:
        for path in sorted(root.rglob("*.py")):
            if not NEVER_COMPILED & set(path.parts[len(root.parts) :]):
                yield path


@lru_cache(maxsize=1)
def sources_hash() -> str:
    """Hash over every source file that compiled code can come from, and the versions that compile it."""
    return hash_of(files())


def hash_of(paths: Iterable[Path]) -> str:
    """Hash over some source files, in their order, and the versions that compile them."""
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.name.encode() + path.read_bytes())
    digest.update(versions().encode())
    return digest.hexdigest()


def versions() -> str:
    """Of all that turns sources into machine code here."""
    return repr((__version__, numba.__version__, np.__version__, sys.version, platform.machine(), _cpu()))


def _cpu() -> str:
    import llvmlite.binding

    return str(llvmlite.binding.get_host_cpu_name())
