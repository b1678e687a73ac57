"""The blocks of code in the pages of the manual."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    path.relative_to(ROOT)
    for path in (
        ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md",
        ROOT / "systemd" / "README.md", ROOT / "benchmarks" / "README.md",
        *(ROOT / "docs").rglob("*.md"),
    )
)  # fmt: skip
FENCE = re.compile(r"^(`{3,})(\w*)[^\n]*\n(.*?)^\1[ ]*$", re.M | re.S)


class Block(NamedTuple):
    page: Path
    line: int  # of its first line
    language: str
    text: str

    @property
    def where(self) -> str:
        return f"{self.page}:{self.line}"


def blocks(page: Path, text: str | None = None) -> list[Block]:
    """The fenced blocks of a page; `text` replaces that of the file."""
    text = (ROOT / page).read_text() if text is None else text
    return [Block(page, text.count("\n", 0, m.start(3)) + 1, m[2], m[3]) for m in FENCE.finditer(text)]


def commands(block: Block) -> Iterator[tuple[str, str]]:
    """Where, and the command: each line that calls rtctl, with those that go on behind a backslash.

    A whole block of bash is commands; of a console those lines with a prompt.
    """
    lines = block.text.split("\n")
    number = 0
    while number < len(lines):
        first, line = number, lines[number]
        while line.endswith("\\") and number + 1 < len(lines):
            number += 1
            line = f"{line[:-1]} {lines[number].strip()}"
        number += 1
        if block.language == "console":
            prompt = re.match(r"\s*\w*\$ (.*)", line)
            line = prompt[1] if prompt else ""
        elif block.language != "bash":
            continue
        called = re.match(r"\s*(?:sudo (?:-u \w+ )?|time |\w+=\S+ |\.venv/bin/)*(rtctl( .*)?)$", line)
        if called:
            yield f"{block.page}:{block.line + first}", called[1]


def prose(text: str) -> str:
    """Text of a page without code blocks and code spans."""
    return re.sub(r"`[^`\n]*`", "", FENCE.sub("", text))
