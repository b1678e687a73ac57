"""Compilation of the entry points that nearly every test process runs, once and in one process.

The reel unit in its five ways to run has ten entry points. A process that starts alone compiles its own with all steps
beneath, 10 to 20 s each; all of them in one process take less than half of that.
"""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager

from rtctl import machines
from rtctl.cli.build import _compile
from rtctl.cli.common import load_config, with_loop
from rtctl.config.cache import cache_folder

WAYS = (("fused", "shm"), ("lockstep", "shm"), ("lockstep", "zmq"), ("real", "shm"), ("real", "zmq"))


def reel_unit() -> None:
    """Compile the reel unit for later processes. Returns at once if another worker compiles it or the cache is full."""
    with _alone() as alone:
        for mode, link in WAYS if alone else ():
            _compile(machines.build(with_loop(load_config("ivu", []), mode, link)), link)


@contextmanager
def _alone() -> Iterator[bool]:
    """Whether no other process is inside."""
    folder = cache_folder()
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "tests.lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
        else:
            yield True
