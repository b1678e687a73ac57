"""Drawing of a machine as SVG: bodies as boxes, joints as springs or rods, drives as arrows in, sensors below."""

from html import escape

from rtctl.machine_report.grid import above, below, ends, grid, marks, on_joint
from rtctl.machine_report.words import joint_label, size_label
from rtctl.plants.graph.description import Description

WIDE, HIGH, GAP, LINE, EDGE = 170, 64, 130, 18, 24
INK, BLUE, ORANGE, GREEN, PALE = "#222222", "#0b62a8", "#d9730d", "#2e8b57", "#eef3f8"
HEAD = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="{w}" height="{h}" viewBox="0 0 {w} {h}" '
    'font-family="Helvetica, Arial, sans-serif" font-size="13" fill="{ink}">'
)


def svg(machine: Description, title: str) -> str:
    """SVG text of the drawing."""
    g = grid(machine)
    heads, feet = [0] * g.rows, [0] * g.rows
    for name, (_, row) in g.places.items():
        heads[row] = max(heads[row], len(above(machine, name)))
        feet[row] = max(feet[row], len(below(machine, name)))
    top, y = [], EDGE + 2 * LINE
    for row in range(g.rows):
        top.append(y + heads[row] * LINE + (26 if heads[row] else 0))
        y = top[-1] + HIGH + feet[row] * LINE + (26 if feet[row] else 0) + 2 * LINE
    left = [EDGE + c * (WIDE + GAP) for c in range(g.columns)]
    width, height = left[-1] + WIDE + EDGE + 40, y
    out = [HEAD.format(w=width, h=height, ink=INK), f'<rect width="{width}" height="{height}" fill="white"/>']
    out.append(_text(EDGE, EDGE + 2, title, weight="bold", size=15))
    for name, joint in machine.joints.items():
        words = [name, *joint_label(machine, name), *on_joint(machine, name)]
        a, b = sorted(g.places[end] for end in ends(joint))
        out += _joint(left, top, a, b, words, joint.stiffness is not None)
    for name, (column, row) in g.places.items():
        label = [name, size_label(machine, name), marks(machine, name)]
        out += _body(left[column], top[row], [word for word in label if word])
        out += _arrows(left[column], top[row], above(machine, name), below(machine, name))
    return "\n".join([*out, "</svg>"]) + "\n"


def _text(x: float, y: float, words: str, **style: object) -> str:
    anchor, size = style.get("anchor", "start"), style.get("size", 13)
    weight, fill = style.get("weight", "normal"), style.get("fill", INK)
    return (
        f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}" font-size="{size}" font-weight="{weight}" '
        f'fill="{fill}">{escape(words)}</text>'
    )


def _body(x: float, y: float, label: list[str]) -> list[str]:
    out = [
        f'<rect x="{x:g}" y="{y:g}" width="{WIDE}" height="{HIGH}" rx="6" fill="{PALE}" stroke="{INK}" '
        'stroke-width="1.5"/>'
    ]
    first = y + HIGH / 2 - (len(label) - 1) * 9 + 5
    for i, words in enumerate(label):
        style = {"weight": "bold"} if i == 0 else {"size": 12}
        out.append(_text(x + WIDE / 2, first + i * LINE, words, anchor="middle", **style))
    return out


def _arrows(x: float, y: float, drives: list[str], sensors: list[str]) -> list[str]:
    out = []
    if drives:
        out.append(_arrow(x + 20, y - 22, y - 2, ORANGE))
        out += [
            _text(x + 12, y - 28 - (len(drives) - 1 - i) * LINE, words, fill=ORANGE) for i, words in enumerate(drives)
        ]
    if sensors:
        out.append(_arrow(x + 20, y + HIGH + 2, y + HIGH + 22, GREEN))
        out += [_text(x + 12, y + HIGH + 38 + i * LINE, words, fill=GREEN) for i, words in enumerate(sensors)]
    return out


def _arrow(x: float, y: float, end: float, color: str) -> str:
    tip = f"{x:g},{end:g} {x - 5:g},{end - 8:g} {x + 5:g},{end - 8:g}"
    return (
        f'<line x1="{x:g}" y1="{y:g}" x2="{x:g}" y2="{end - 6:g}" stroke="{color}" stroke-width="2"/>'
        f'<polygon points="{tip}" fill="{color}"/>'
    )


def _joint(
    left: list[int], top: list[int], a: tuple[int, int], b: tuple[int, int], words: list[str], spring: bool
) -> list[str]:
    """SVG elements of a joint between two places, with its label above and below."""
    if a[0] == b[0]:
        x, y1, y2 = left[a[0]] + WIDE - 30, top[a[1]] + HIGH, top[b[1]]
        out = [_link([(x, y1), (x, y2)], spring, upright=True)]
        return out + [_text(x + 14, y2 - 10 - (len(words) - 1 - i) * 15, w, size=12) for i, w in enumerate(words)]
    start, end = left[a[0]] + WIDE, left[b[0]]
    one, two = top[a[1]] + HIGH / 2, top[b[1]] + HIGH / 2
    low = max(one, two)
    out = []
    first, last = start, end
    if one != two:
        bend = start + 14 if two > one else end - 14
        side = start if two > one else end
        path = f"M {side:g} {min(one, two):g} H {bend:g} V {low:g}"
        out.append(f'<path d="{path}" fill="none" stroke="{INK}" stroke-width="1.5"/>')
        first, last = (bend, end) if two > one else (start, bend)
    out.append(_link([(first, low), (last, low)], spring))
    middle = (first + last) / 2
    out.append(_text(middle, low - 14, words[0], anchor="middle", size=12, fill=BLUE, weight="bold"))
    for i, line in enumerate(words[1:]):
        out.append(_text(middle, low + 24 + i * 15, line, anchor="middle", size=11, fill=BLUE))
    return out


def _link(points: list[tuple[float, float]], spring: bool, upright: bool = False) -> str:
    """SVG element of a joint: a zigzag for a spring, two lines for a rigid joint."""
    (x1, y1), (x2, y2) = points
    if not spring:
        dx, dy = (3, 0) if upright else (0, 3)
        return "".join(
            f'<line x1="{x1 + s * dx:g}" y1="{y1 + s * dy:g}" x2="{x2 + s * dx:g}" y2="{y2 + s * dy:g}" '
            f'stroke="{INK}" stroke-width="2"/>'
            for s in (-1, 1)
        )
    teeth = 8
    path = [f"M {x1:g} {y1:g}"]
    for i in range(teeth + 1):
        share = 0.2 + 0.6 * i / teeth
        off = 0 if i in (0, teeth) else 7 * (-1) ** i
        x, y = x1 + (x2 - x1) * share, y1 + (y2 - y1) * share
        path.append(f"L {x + off:g} {y:g}" if upright else f"L {x:g} {y + off:g}")
    path.append(f"L {x2:g} {y2:g}")
    return f'<path d="{" ".join(path)}" fill="none" stroke="{INK}" stroke-width="1.8"/>'
