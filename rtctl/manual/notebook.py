"""Script with cells, executed into a page: `python -m rtctl.manual.notebook docs/notebook.py docs/notebook.md`.

Cells begin with `# %%`, text cells with `# %% [markdown]`. The last expression of a cell is shown as in a notebook:
a figure as a picture beside the page, any other value as text. The script runs in a temporary folder.
"""

import ast
import contextlib
import io
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

MARK = re.compile(r"^# %%(.*)$", re.MULTILINE)
PICTURE = 100  # dots per inch


class Cell(NamedTuple):
    """One cell: its text, and whether it is a text cell."""

    text: str
    words: bool


def cells(script: str) -> list[Cell]:
    """Cells of a script."""
    parts = MARK.split(script)
    found = []
    for mark, body in zip(parts[1::2], parts[2::2], strict=True):
        words = "[markdown]" in mark
        text = "\n".join(line.removeprefix("#").removeprefix(" ") for line in body.splitlines()) if words else body
        found.append(Cell(text.strip("\n"), words))
    return found


def run(text: str, names: dict[str, Any]) -> tuple[str, Any]:
    """Printed text of a cell, and the value of its last expression; None where it ends in a statement."""
    tree = ast.parse(text)
    end = tree.body[-1] if tree.body else None
    last = end if isinstance(end, ast.Expr) else None
    if last is not None:
        tree.body.pop()
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, "cell", "exec"), names)
        value = eval(compile(ast.Expression(last.value), "cell", "eval"), names) if last is not None else None
    return printed.getvalue(), value


def page(script: Path, out: Path, pictures: Path) -> str:
    """Text of a script's page; pictures are saved into the folder `pictures`, links are relative to `out`."""
    names: dict[str, Any] = {"__name__": "__main__"}
    parts = []
    number = 0
    with _elsewhere():
        for cell in cells(script.read_text("utf-8")):
            if cell.words:
                parts.append(cell.text)
                continue
            parts.append(f"```python\n{cell.text}\n```")
            printed, value = run(cell.text, names)
            if printed:
                parts.append(f"```text\n{printed.rstrip()}\n```")
            if hasattr(value, "savefig"):
                number += 1
                file = pictures / f"{script.stem}_{number}.png"
                value.savefig(file, dpi=PICTURE)
                parts.append(f"![{script.stem} {number}]({os.path.relpath(file, out.parent)})")
            elif value is not None:
                parts.append(f"```text\n{shown(value)}\n```")
    return "\n\n".join(parts) + "\n"


def shown(value: Any) -> str:
    """Text of a value."""
    return str(value) if hasattr(value, "to_string") else repr(value)


@contextlib.contextmanager
def _elsewhere() -> Iterator[None]:
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        yield


def main(argv: list[str]) -> int:
    """Execute a script into a page."""
    script, out = (Path(word).resolve() for word in argv)
    out.write_text(page(script, out, out.parent / "images"), "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
