"""Result of a check, and the files that checks read. A hidden file gives the verdict unknown, never an error."""

import gzip
import os
import re
from pathlib import Path
from typing import Literal, NamedTuple

Verdict = Literal["good", "fair", "bad", "unknown"]


class Finding(NamedTuple):
    """Result of one check; `change` and `command` are empty where nothing is to be changed."""

    name: str
    found: str
    verdict: Verdict
    cost: str = ""  # effect on a loop
    change: str = ""  # what to change, in words
    command: str = ""  # how: a command, or a file and what to write into it


class Tree:
    """Files of a computer below `root`, which a test replaces."""

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
        """Matching paths below the root, in order of their numbers."""
        try:
            found = [str(path.relative_to(self.root)) for path in self.root.glob(pattern)]
        except OSError:
            return []
        return sorted(found, key=lambda path: [int(word) for word in re.findall(r"\d+", path)])

    def opens(self, path: str) -> bool | None:
        """Whether a file can be opened for writing; None where it is missing. Nothing is written."""
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
        """Soft limit of this process by its title in /proc/self/limits; inf for unlimited, None where hidden."""
        for line in (self.read("proc/self/limits") or "").splitlines():
            if line.startswith(title):
                value = line[len(title) :].split()[0]
                return float("inf") if value == "unlimited" else float(value)
        return None

    def status(self, key: str) -> str | None:
        """Value of a key in /proc/self/status; None where it is missing or hidden."""
        for line in (self.read("proc/self/status") or "").splitlines():
            if line.startswith(f"{key}:"):
                return line.partition(":")[2].strip()
        return None

    def capable(self, bit: int) -> bool:
        """Whether this process has a capability. Source: capability.h."""
        return bool(int(self.status("CapEff") or "0", 16) >> bit & 1)


def cpu_list(text: str) -> list[int]:
    """CPU numbers of a kernel's list: "0-2,5" is 0, 1, 2, 5. Other words are left out."""
    found: set[int] = set()
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d+)(?:-(\d+))?\s*", part)
        if match:
            found.update(range(int(match[1]), int(match[2] or match[1]) + 1))
    return sorted(found)
