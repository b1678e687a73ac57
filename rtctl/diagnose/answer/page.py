"""Parts of the HTML report of a diagnosis: figures as inline SVG, and intervals in words."""

import io
import re
from html import escape
from typing import NamedTuple

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from rtctl.diagnose.answer import figure_style as figures
from rtctl.diagnose.answer import si_format as numbers
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED, Interval

COLOR = {NAMED: "green", AMBIGUOUS: "yellow", UNNAMED: "magenta", NOTHING: "cyan"}


class Picture(NamedTuple):
    svg: str
    caption: str


def svg(figure: Figure, prefix: str, alt: str) -> str:
    """Inline SVG of a figure: text stays text, ink is the colour of the page, ids are unique, no external links."""
    out = io.StringIO()
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": prefix, "font.family": "sans-serif"}):
        figure.savefig(out, format="svg", transparent=True, metadata={"Date": None})
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.S)
    text = re.sub(r'\sxmlns(:\w+)?="[^"]*"', "", text)
    text = re.sub(r'\bid="', f'id="{prefix}-', text)
    text = re.sub(r"url\(#", f"url(#{prefix}-", text)
    text = re.sub(r'xlink:href="#', f'href="#{prefix}-', text).replace("xlink:href=", "href=")
    text = text.replace(figures.INK, "currentColor")
    label = f' role="img" aria-labelledby="{prefix}-alt"'
    return re.sub(r"<svg([^>]*)>", rf'<svg\1{label}><title id="{prefix}-alt">{escape(alt)}</title>', text, count=1)


def interval(v: Interval, unit: str) -> tuple[str, str]:
    """Value with its unit, and its 90 % interval in this unit."""
    scale, shown = figures.prefixed(np.array([v.value]), unit)
    width = max(v.high - v.low, 1e-30)
    digits = int(np.clip(np.ceil(np.log10(max(abs(v.value), width) / width)) + 1, 2, 6)) if np.isfinite(width) else 2
    value, low, high = (numbers.figures(x * scale, digits) if np.isfinite(x) else "-" for x in (v.value, v.low, v.high))
    return f"{value} {shown}".rstrip(), f"{low} to {high}"
