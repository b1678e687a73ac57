"""Window of a HAL thread: law.hal in LinuxCNC's rtapi_app, with wake-ups counted by wakeup.c.

Installs nothing: component files come from the package, and the counting library is preloaded.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

HERE = Path(__file__).parent
BUCKETS = 1_000_000  # buckets of wakeup.c, one per nanosecond, plus one for later wake-ups
NOBODY = 65534  # user id to which rtapi_app drops when started by root
REALTIME = Path("/usr/lib/linuxcnc/realtime")


class NoPeerError(Exception):
    """HAL cannot be measured here; the message says why."""


class Window(NamedTuple):
    """Histogram of lateness per ns, and clock counts per tick of pid, lowpass, pid, and of the whole thread."""

    wakeups: np.ndarray  # (BUCKETS + 1,)
    times: np.ndarray  # (ticks, 4)


def why_not() -> str | None:
    """Reason why a HAL thread cannot be measured here, as a sentence; None where it can."""
    if shutil.which("halrun") is None or not REALTIME.exists():
        return "LinuxCNC is not installed here; it comes with Debian's linuxcnc-uspace"
    if os.geteuid() != 0:
        return "a HAL thread's wake-ups are counted by a preloaded library, which rtapi_app takes from root only"
    if shutil.which("cc") is None:
        return "there is no C compiler (cc) here to make the library that counts a HAL thread's wake-ups"
    if subprocess.run([REALTIME, "status"], capture_output=True, env=environment()).returncode == 0:
        return "a HAL session runs on this machine already; end it with `halrun -U`"
    return None


def environment(**more: Any) -> dict[str, str]:
    return {
        **os.environ,
        "RTAPI_UID": str(NOBODY),
        "LINUXCNC_FORCE_REALTIME": "1",
        **{k: str(v) for k, v in more.items()},
    }


def build(folder: Path) -> Path:
    """Compile the counting library into `folder`."""
    library = folder / "wakeup.so"
    command = ["cc", "-O2", "-shared", "-fPIC", "-o", str(library), str(HERE / "wakeup.c"), "-ldl"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise NoPeerError(f"wakeup.c does not compile here: {done.stderr.strip().splitlines()[-1]}")
    return library


def run(library: Path, rate: float, seconds: float, folder: Path) -> Window:
    """Run one window. Raises NoPeerError with LinuxCNC's message where it does not run in real time."""
    shared = folder / "hal"  # rtapi_app opens its socket as NOBODY
    shutil.rmtree(shared, ignore_errors=True)
    shared.mkdir()
    shared.chmod(0o777)
    samples = shared / "samples"
    wakeups = Path("/dev/shm") / f"rtctl-wakeups-{os.getpid()}"  # in memory: a disk file would fault
    wakeups.write_bytes(bytes(4 * (BUCKETS + 1)))
    try:
        done = subprocess.run(
            ["halrun", "-f", str(HERE / "law.hal")],
            env=environment(
                LD_PRELOAD=library, WAKEUP=wakeups, RTAPI_FIFO_PATH=shared / "fifo", HOME=shared,
                RTAPI_CPU_NUMBER=max(os.sched_getaffinity(0)), PERIOD=round(1e9 / rate),
                SAMPLES=round(seconds * rate), SAMPLES_FILE=samples,
            ),
            capture_output=True, text=True, timeout=seconds + 30, start_new_session=True,
        )  # fmt: skip
        counts = np.fromfile(wakeups, np.uint32)
    except subprocess.TimeoutExpired:
        subprocess.run(["halrun", "-U"], env=environment(RTAPI_FIFO_PATH=shared / "fifo"), capture_output=True)
        raise NoPeerError(f"the HAL thread did not end within {seconds + 30:g} s") from None
    finally:
        wakeups.unlink()
    if done.returncode or "non-realtime" in done.stderr or not samples.exists():
        print(done.stderr, file=sys.stderr)
        raise NoPeerError("LinuxCNC's rtapi_app does not run in real time here; what it said is above")
    if counts.sum() == 0:
        raise NoPeerError("no wake-up of the HAL thread was counted: rtapi_app does not sleep by clock_nanosleep here")
    return Window(counts, _times(samples))


def _times(path: Path) -> np.ndarray:
    """Rows of `halsampler` without those after an overrun, which contain a word."""
    rows = [line.split() for line in path.read_text().splitlines()]
    return np.array([row for row in rows if len(row) == 4 and row[0].isdigit()], np.int64)
