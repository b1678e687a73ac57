"""Curve of a physics term, as braille dots on the terminal and as a PNG."""

import math
from pathlib import Path
from typing import Any

import numpy as np

COLUMNS, LINES = 56, 12
DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # of a braille cell, row by row (Unicode 6.0, 2800)
SPARSE = 6  # columns between two dots of the curve without the term


def lines(curve: Any, braille: bool = True) -> list[str]:
    """Lines of text with the curve, and in sparse dots the curve without the term; `braille` or plain characters."""
    (left, right), (low, high) = ends(curve.x), ends(np.concatenate([curve.y, curve.without]))
    wide, tall = 2 * COLUMNS, 4 * LINES
    dots = np.zeros((tall, wide), bool)

    def row(y: np.ndarray) -> np.ndarray:
        return np.round((high - y) / (high - low) * (tall - 1)).astype(int)

    columns, rows, plain = (
        np.round((curve.x - left) / (right - left) * (wide - 1)).astype(int),
        row(curve.y),
        row(curve.without),
    )
    sparse = columns % SPARSE == 0
    dots[plain[sparse], columns[sparse]] = True
    dots[rows, columns] = True
    for k in np.flatnonzero((np.abs(np.diff(rows)) > 1) & (np.abs(np.diff(columns)) <= 1)):  # connect steep parts
        dots[min(rows[k : k + 2]) : max(rows[k : k + 2]) + 1, columns[k + 1]] = True
    ticks = {0: number(high, high - low), LINES - 1: number(low, high - low)}
    zero = int(row(np.zeros(1))[0]) // 4
    if low < 0.0 < high and 0 < zero < LINES - 1:
        ticks[zero] = "0"
    out = [f"{'':10}{curve.y_words}"]
    for line in range(LINES):
        cells = dots[4 * line : 4 * line + 4].reshape(4, COLUMNS, 2).transpose(1, 0, 2)
        text = "".join(character(cell, braille) for cell in cells)
        out.append(f"{ticks.get(line, ''):>9} |{text}".rstrip())
    out.append(f"{'':10}+{'-' * COLUMNS}")
    a, b = number(left, right - left), number(right, right - left)
    return [*out, f"{'':11}{a}{curve.x_words:^{COLUMNS - len(a) - len(b)}}{b}"]


def character(cell: np.ndarray, braille: bool) -> str:
    """Character of four rows of two dots."""
    if not cell.any():
        return " "
    return chr(0x2800 + sum(DOTS[r][c] for r, c in np.argwhere(cell))) if braille else "*"


def number(value: float, span: float) -> str:
    """Text of one end of an axis, with enough digits for its `span`."""
    return f"{round(value, 1 - math.floor(math.log10(span))) + 0.0:.6g}"


def ends(values: np.ndarray) -> tuple[float, float]:
    """Lowest and highest value; 1 apart where they differ by less than the smallest normal number."""
    low, high = float(values.min()), float(values.max())
    return (low, high) if high - low >= np.finfo(float).tiny else (low - 0.5, high + 0.5)


def sizes(curve: Any) -> str:
    """Text with the node and the parameter values of a drawn curve."""
    given = curve.settings.model_dump(exclude_unset=True)
    values = [f"{k} {v:g}" for k, v in given.items() if isinstance(v, int | float) and not isinstance(v, bool)]
    return f"drawn at {given['node']} of the {curve.kind}" + (f" with {', '.join(values)}" if values else "")


def picture(curve: Any, path: Path) -> None:
    """Draw the curve into a PNG. Raises UserError where the file cannot be written."""
    from matplotlib.figure import Figure

    from rtctl.config.errors import UserError
    from rtctl.config.files import replaced

    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(curve.x, curve.without, ":", color="0.5", label="without")
    axes.plot(curve.x, curve.y, color="C0", label=curve.settings.term)
    axes.set(xlabel=curve.x_words, ylabel=curve.y_words, title=sizes(curve))
    axes.legend()
    axes.grid(alpha=0.3)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replaced(path, "wb") as file:
            figure.savefig(file, format="png", dpi=150)
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror}") from None
