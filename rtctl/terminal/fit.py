"""Lines that fit into a width: the least important part is left out first, and no line wraps."""

from typing import NamedTuple

from rich.cells import cell_len
from rich.text import Text

GAP = 2  # cells between two parts of a line


class Part(NamedTuple):
    """Part of a line; rank 0 is left out last."""

    rank: int
    text: str
    style: str = ""


def fit(parts: list[Part], width: int, ellipsis: str = "…") -> Text:
    """Line of the parts; those of the highest rank are left out until it takes at most `width` cells."""
    kept = [part for part in parts if part.text]
    while len(kept) > 1 and sum(cell_len(part.text) + GAP for part in kept) - GAP > width:
        worst = max(part.rank for part in kept)
        kept.remove(next(part for part in reversed(kept) if part.rank == worst))
    line = Text(no_wrap=True, overflow="crop")
    for n, part in enumerate(kept):
        line.append(" " * GAP if n else "").append(part.text, part.style)
    if line.cell_len > width:
        line.truncate(max(width - cell_len(ellipsis), 0))
        line.append(ellipsis[: max(width, 0)])
    return line


def columns(widths: dict[str, int], order: tuple[str, ...], width: int) -> set[str]:
    """Names of the columns that fit side by side, `order` from the most important to the least."""
    kept: set[str] = set()
    used = 0
    for name in order:
        used += widths[name] + (GAP if kept else 0)
        if used > width and kept:
            break
        kept.add(name)
    return kept
