"""What a check says, and the files that it reads. A file that is hidden is something unknown, never an error."""

import gzip
import os
import re
from pathlib import Path
from typing import Literal, NamedTuple

Verdict = Literal["good", "fair", "bad", "unknown"]


class Finding(NamedTuple):
    """One check. `change` and `command` are empty where there is nothing to change."""

    name: str
    found: str
    verdict: Verdict
    cost: str = ""  # what it costs a loop
    change: str = ""  # what to change, in words
    command: str = ""  # how: a command, or a file and what to write into it


class Tree:
    """The files of a machine beneath `root`, which a test puts elsewhere."""

    def __init__(self, root: Path | str = "/"):
        self.root = Path(root)

    def read(self, path: str) -> str | None:
        """Text of a file without its last newline; None where it is missing or hidden. Files *.gz are unpacked."""
        try:
            data = (self.root / path).read_bytes()
            return (gzip.decompress(data) if path.endswith(".gz") else data).decode(errors="replace").rstrip("\n")
        except (OSError, EOFError):
            return None

    def number(self, path: str) -> int | None:
        """An integer from a file; None where there is none."""
        try:
            return int(self.read(path) or "")
        except ValueError:
            return None

    def glob(self, pattern: str) -> list[str]:
        """Paths beneath the root that match, in order of their numbers."""
        try:
            found = [str(path.relative_to(self.root)) for path in self.root.glob(pattern)]
        except OSError:
            return []
        return sorted(found, key=lambda path: [int(word) for word in re.findall(r"\d+", path)])

    def opens(self, path: str) -> bool | None:
        """Whether we may open a file for writing; None where it is missing. Nothing is written."""
        try:
            os.close(os.open(self.root / path, os.O_WRONLY))
        except FileNotFoundError:
            return None
        except OSError:
            return False
        return True

    def option(self, name: str) -> str | None:
        """Value of an option of the kernel's command line, "" for one without a value, None where it is not given."""
        words = (self.read("proc/cmdline") or "").split()
        values = [word.partition("=")[2] for word in words if word.partition("=")[0] == name]
        return values[-1] if values else None

    def limit(self, title: str) -> float | None:
        """Soft limit of this process by its title in /proc/self/limits; inf where there is none, None where hidden."""
        for line in (self.read("proc/self/limits") or "").splitlines():
            if line.startswith(title):
                value = line[len(title) :].split()[0]
                return float("inf") if value == "unlimited" else float(value)
        return None

    def status(self, key: str) -> str | None:
        """A line of /proc/self/status by its key."""
        for line in (self.read("proc/self/status") or "").splitlines():
            if line.startswith(f"{key}:"):
                return line.partition(":")[2].strip()
        return None

    def capable(self, bit: int) -> bool:
        """Whether this process has a capability. Source: capability.h."""
        return bool(int(self.status("CapEff") or "0", 16) >> bit & 1)


def cpu_list(text: str) -> list[int]:
    """The CPUs of a kernel's list: "0-2,5" is 0, 1, 2, 5. Words that are no numbers are left out."""
    found: set[int] = set()
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d+)(?:-(\d+))?\s*", part)
        if match:
            found.update(range(int(match[1]), int(match[2] or match[1]) + 1))
    return sorted(found)
