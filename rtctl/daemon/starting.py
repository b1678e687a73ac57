"""Waiting for the first tick: without time limit while a child uses the CPU, with a progress line.

Compilation with a cold cache takes ten seconds, or many minutes on a small or busy computer, so there is no limit on
the total time. If no child uses the CPU for `HUNG` s, the start has hung; the states in /proc give the cause.
"""

import signal
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError
from rtctl.daemon.children import ChildProcess

HUNG = 120.0  # s without CPU time in any child, after which the start has hung
TELL = 10.0  # s between two progress lines
STATES = {
    "T": "it is stopped (SIGSTOP, or Ctrl-Z): continue it with SIGCONT",
    "D": "it waits for a disk or a driver that does not answer",
    "S": "it waits for something that does not come",
}


class Starting:
    """Progress of child processes before the first tick. `say` gets a progress line every TELL s."""

    def __init__(
        self,
        children: Sequence[ChildProcess],
        say: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
        cpu: Callable[[int], tuple[str, float]] | None = None,
    ):
        self._children, self._say, self._clock = children, say, clock
        self._cpu = cpu or used
        self._begun = self._moved = self._told = clock()
        self._seen: list[float] = []
        self.compiling: dict[str, str] = {}  # role -> function that it compiles

    def look(self) -> None:
        """Check the children; call regularly. Raises UserError where no child has used the CPU for HUNG s."""
        now = self._clock()
        found = [self._cpu(child.pid) for child in self._children]
        seconds = [spent for _, spent in found]
        if seconds != self._seen:
            self._seen, self._moved = seconds, now
        if now - self._moved > HUNG:
            why = "; ".join(
                f"the {child.role} process (pid {child.pid}) has used no CPU for {now - self._moved:.0f} s: "
                f"{STATES.get(state, f'its state is {state!r}')}"
                for child, (state, _) in zip(self._children, found, strict=True)
            )
            raise UserError(f"the machine does not start: {why}")
        if now - self._told >= TELL:
            self._told = now
            what = "; ".join(f"the {role} compiles {name}" for role, name in self.compiling.items())
            self._say(f"starting for {now - self._begun:.0f} s{': ' if what else ''}{what}; Ctrl-C ends it")


def used(pid: int) -> tuple[str, float]:
    """State letter and CPU ticks of a process so far; ("", 0) for one that has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return "", 0.0
    return fields[0], float(fields[11]) + float(fields[12])


def ended(child: Any) -> str:
    """Cause of a child's end as text: the signal that killed it, its last error output, or its exit code."""
    code, words = child.process.poll(), child.last_words()
    if code is not None and code < 0:
        memory = (
            " (out of memory? see `dmesg`: close other programs, or shorten record.seconds)"
            if -code == signal.SIGKILL
            else ""
        )
        return f"killed by {_signal(-code)}{memory}" + (f"; its last words: {words}" if words else "")
    return words or f"exit code {code}, without a word"


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # a real-time signal
        return f"signal {number}"
