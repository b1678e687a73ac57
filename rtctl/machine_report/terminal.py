"""Drawing of a machine for the terminal: boxes, springs between them, drives above and sensors below."""

from rtctl.machine_report.grid import above, below, ends, grid, marks, on_joint
from rtctl.plants.graph.description import Description

SPRING, ROD = "\u2571\u2572", "\u2550"
GAP = 12  # cells between two columns, at least


class Canvas:
    """Grid of characters to draw into."""

    def __init__(self, width: int, height: int):
        self.cells = [[" "] * width for _ in range(height)]

    def text(self, x: int, y: int, words: str) -> None:
        for i, letter in enumerate(words):
            if 0 <= y < len(self.cells) and 0 <= x + i < len(self.cells[y]):
                self.cells[y][x + i] = letter

    def lines(self) -> list[str]:
        found = ["".join(row).rstrip() for row in self.cells]
        while found and not found[-1]:
            found.pop()
        return found


def drawing(machine: Description) -> list[str]:
    """Lines of a machine's drawing."""
    g = grid(machine)
    label = {name: [name, *([f"({marks(machine, name)})"] if marks(machine, name) else [])] for name in g.places}
    widths, heads, feet = [0] * g.columns, [0] * g.rows, [0] * g.rows
    for name, (column, row) in g.places.items():
        words = [*label[name], *above(machine, name), *below(machine, name)]
        widths[column] = max(widths[column], *(len(word) + 4 for word in words))
        heads[row] = max(heads[row], len(above(machine, name)))
        feet[row] = max(feet[row], len(below(machine, name)))
    gaps = [GAP] * g.columns
    for joint_name, joint in machine.joints.items():
        column = min(g.places[end][0] for end in ends(joint))
        words = [joint_name, *on_joint(machine, joint_name)]
        gaps[column] = max(gaps[column], *(len(word) + 7 for word in words))
    left = [sum(widths[:c]) + sum(gaps[:c]) for c in range(g.columns)]
    top, y = [], 0
    for row in range(g.rows):
        top.append(y + heads[row] + (heads[row] > 0))
        y = top[-1] + 4 + feet[row] + (feet[row] > 0) + 1
    canvas = Canvas(left[-1] + widths[-1] + gaps[-1], y + 1)
    for name, joint in machine.joints.items():
        _joint(canvas, g.places, left, top, widths, name, joint, on_joint(machine, name))
    for name, (column, row) in g.places.items():
        _body(canvas, left[column], top[row], widths[column], label[name], above(machine, name), below(machine, name))
    return canvas.lines()


def _body(canvas: Canvas, x: int, y: int, width: int, label: list[str], drives: list[str], sensors: list[str]) -> None:
    canvas.text(x, y, "\u250c" + "\u2500" * (width - 2) + "\u2510")
    for i in range(2):
        canvas.text(x, y + 1 + i, "\u2502" + (label[i] if i < len(label) else "").center(width - 2) + "\u2502")
    canvas.text(x, y + 3, "\u2514" + "\u2500" * (width - 2) + "\u2518")
    for i, words in enumerate(drives):
        canvas.text(x + 1, y - 1 - len(drives) + i, words)
    if drives:
        canvas.text(x + 2, y - 1, "\u25bc")
    if sensors:
        canvas.text(x + 2, y + 4, "\u25b2")
    for i, words in enumerate(sensors):
        canvas.text(x + 1, y + 5 + i, words)


def _joint(
    canvas: Canvas, places: dict[str, tuple[int, int]], left: list[int], top: list[int], widths: list[int],
    name: str, joint: object, more: list[str],
) -> None:  # fmt: skip
    a, b = sorted((places[end] for end in ends(joint)), key=lambda place: place)
    start, end = left[a[0]] + widths[a[0]], left[b[0]]
    pattern = SPRING if getattr(joint, "stiffness", None) is not None else ROD
    if a[0] == b[0]:  # one above the other
        x = left[a[0]] + widths[a[0]] // 2
        for y in range(top[a[1]] + 4, top[b[1]]):
            canvas.text(x, y, pattern[y % len(pattern)])
        canvas.text(x + 2, top[b[1]] - 2, name)
        return
    one, two = top[a[1]] + 1, top[b[1]] + 1
    row, first, last = max(one, two), start, end
    if one != two:
        bend = start + 1 if two > one else end - 2
        for y in range(min(one, two), row):
            canvas.text(bend, y, "\u2502")
        canvas.text(bend, min(one, two), "\u252c")
        canvas.text(bend, row, "\u2514" if two > one else "\u2518")
        canvas.text(start if two > one else end - 1, min(one, two), "\u2500")
        first, last = (bend + 1, end) if two > one else (start, bend)
    for x in range(first, last):
        canvas.text(x, row, "\u2500")
    span = max(last - first - 4, 2)
    canvas.text(first + 2, row, (pattern * span)[:span])
    canvas.text(first + 2, row - 1, name[: last - first - 2])
    for i, words in enumerate(more):
        canvas.text(first + 2, row + 1 + i, words[: last - first - 2])
