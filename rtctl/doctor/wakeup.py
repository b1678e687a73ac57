"""Empty loop: the wake-up of rtctl's loop without its work, in a process of its own that may become real-time.

    python -m rtctl.doctor.wakeup CPU PRIORITY

It prints one JSON object a line: first the refusals of this computer, then a measured window for each line
"PERIOD_NS SECONDS" on standard input. It ends at the end of standard input.
"""

import json
import subprocess
import sys
from typing import Any

import numpy as np

from rtctl.config.isolated import python
from rtctl.idiom import state, tick
from rtctl.loop import histogram
from rtctl.loop.realtime import RealTime
from rtctl.tick import clock
from rtctl.tick.memory import borrowed

WINDOW = state(late=int, skipped=int, lateness=histogram.HISTOGRAM)


@tick
def empty_loop(window, period, ticks):
    """Sleep, wake and count for `ticks` due ticks, as `rtctl.loop.runner.run_real` without link, law and ring."""
    window = borrowed(window)
    w = window[0]
    wake = clock.now() + period
    due = 0
    while due < ticks:
        clock.sleep_until(wake)
        woke = clock.now()
        while woke < wake:  # a signal cut the sleep short
            woke = clock.now()
        lateness = woke - wake
        skipped = lateness // period  # a late tick is counted and never made up for
        histogram.add(w.lateness, lateness)
        w.late += 1 if 2 * lateness > period else 0
        w.skipped += skipped
        due += skipped + 1
        wake += (skipped + 1) * period


def main(argv: list[str]) -> int:
    cpu, priority = int(argv[1]), int(argv[2])
    empty_loop(np.zeros(1, WINDOW), 1000, 0)  # compile before becoming real-time
    realtime = RealTime(priority, cpu)
    print(json.dumps({"lacks": [str(lack) for lack in realtime.lacks]}), flush=True)
    for line in sys.stdin:
        period, seconds = map(int, line.split())
        window = np.zeros(1, WINDOW)
        empty_loop(window, period, seconds * clock.SECOND // period)
        print(json.dumps(_answer(window[0])), flush=True)
    realtime.close()
    return 0


def _answer(w: np.void) -> dict[str, Any]:
    h = w["lateness"]
    filled = np.flatnonzero(h["bucket"])
    return {
        "late": int(w["late"]),
        "skipped": int(w["skipped"]),
        "max": int(h["max"]),
        "bucket": filled.tolist(),
        "count": h["bucket"][filled].tolist(),
    }


class Sleeper:
    """Client of the empty loop's process: `with Sleeper(cpu, priority) as s: s.window(100_000, 1)`.

    `lacks` are the computer's refusals. Raises RuntimeError with the last line of standard error where the process
    ended.
    """

    def __init__(self, cpu: int, priority: int):
        command = python("-m", "rtctl.doctor.wakeup", str(cpu), str(priority))
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    def __enter__(self) -> "Sleeper":
        try:
            self.lacks: list[str] = self._read()["lacks"]
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: Any) -> None:
        self._process.kill()  # the process has no results to save
        self._process.communicate()

    def window(self, period_ns: int, seconds: int) -> dict[str, Any]:
        """One window: wake-ups by bucket of `rtctl.loop.histogram`, `late` and `skipped` of them, `max` in ns."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{period_ns} {seconds}\n")
        self._process.stdin.flush()
        return self._read()

    def _read(self) -> dict[str, Any]:
        assert self._process.stdout is not None and self._process.stderr is not None
        line = self._process.stdout.readline()
        if not line:
            said = self._process.stderr.read().strip().splitlines()
            raise RuntimeError(f"the empty loop ended: {said[-1] if said else 'it did not say why'}")
        return json.loads(line)


if __name__ == "__main__":
    sys.exit(main(sys.argv))
