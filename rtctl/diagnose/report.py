"""The report of a diagnosis: one HTML file that needs nothing else, and a short table for the terminal."""

import io
import re
from collections import defaultdict
from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
import yaml
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from rtctl.config.files import write_text
from rtctl.diagnose import figures, numbers, played, words
from rtctl.diagnose.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED, Diagnosis, Effect, Interval
from rtctl.diagnose.model import FITTED
from rtctl.diagnose.simulate import Simulator
from rtctl.plants.physics import TERMS

NAME = "report.html"
MOTION_ALT = "The motion of the next experiment over its time, from where the recording began."
COLOR = {NAMED: "green", AMBIGUOUS: "yellow", UNNAMED: "magenta", NOTHING: "cyan"}
PLANT = {"ivu": "a two-reel tape unit", "ldu": "a linear drive unit", "axis": "an axis"}
Draw = Callable[[Diagnosis, Simulator], Figure | None]
PICTURES: dict[str, tuple[Draw, str]] = {
    "heldout": (figures.heldout_overlay, "Recording and simulation on rows that no fit saw, the error below. The grey "
                "band holds 95 % of what noise makes."),
    "missing": (figures.missing_force, "What it took to keep the simulation on the recorded track, by the axis where "
                "the effect lives: medians with their 95 % bands, and what the new model gives instead."),
    "polar": (figures.polar_map, "The same around one turn; the middle ring is zero."),
    "turn": (figures.turn_map, "Torque that the model lacks over one turn, with its 95 % band, and what repeats how "
             "often in it; the table is torque_over_turn.csv."),
    "where": (figures.where_map, "Rms error on the recorded track of each sensor in each regime. A value near 1 or "
              "below is what the sensor resolves."),
    "evidence": (figures.evidence_bars, "What each hypothesis explains of the error beyond noise. Left of the dashed "
                 "line is chance; brackets join what was found with its look-alikes."),
    "parameters": (figures.parameters, "Fitted parameters over the nominal values: the owner's, or where case.json"
                   " gives none, estimated from the recording. A wrong value is not missing physics."),
    "spectra": (figures.spectra, "Error by frequency, and missing force by order of the shaft, before and after."),
    "coverage": (figures.coverage, "Each effect at each node: a dot could be tested, a cross could not."),
}  # fmt: skip


class Picture(NamedTuple):
    svg: str
    caption: str


def write(d: Diagnosis, folder: Path | str) -> Path:
    """Write report.html into `folder`, which is made where it is missing; its path."""
    path = Path(folder) / NAME
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, html(d))
    return path


def html(d: Diagnosis) -> str:
    """The report as one text."""
    env = Environment(
        loader=PackageLoader("rtctl.diagnose", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    sim = Simulator(d.record)
    r = d.record
    return env.get_template("report.html.j2").render(
        d=d,
        title=f"{PLANT[r.plant]}, {r.t[-1] - r.t[0]:.4g} s at {numbers.nice(1 / r.dt, 'Hz', 3)}",
        verdict=words.verdict_sentences(d),
        summary=summary(d),
        effects=effect_rows(d),
        located=located(d),
        hides=[(words.entry_noun(k, d.owner.units), words.hidden_size(d, k)) for k in d.hides],
        rivals=rival_rows(d),
        experiment=experiment(d),
        parameters=parameter_rows(d),
        findings=[*d.preflight.findings, *r.case.warnings],
        cannot=cannot_lines(d),
        figures=pictures(d, sim),
        footer=f"rtctl diagnose, {d.seconds:.1f} s; {len(r.t)} rows, {d.fit_rows[0]} to {d.fit_rows[1]} fitted.",
    )


def pictures(d: Diagnosis, sim: Simulator) -> dict[str, Picture]:
    """All figures that this diagnosis has."""
    found = {}
    for name, (draw, caption) in PICTURES.items():
        figure = draw(d, sim)
        if figure is not None:
            found[name] = Picture(svg(figure, name, alt_text(d, name, caption)), caption)
    return found


def alt_text(d: Diagnosis, name: str, caption: str) -> str:
    """What a figure shows, for those who do not see it."""
    if name == "heldout":
        return f"{caption} The error {words.falls(d)}."
    if name == "evidence" and d.evidence:
        best = max(d.evidence, key=lambda e: e.gain)
        names = " and ".join(words.entry_noun(name, d.owner.units) for name in best.names)
        return f"{caption} The most, {numbers.percent(best.gain)}: {names}."
    return caption


def svg(figure: Figure, prefix: str, alt: str) -> str:
    """A figure as inline SVG: text stays text, ink is the page's colour, ids are its own, nothing points outside."""
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
    """A value and its 90 % interval in one unit."""
    scale, shown = figures.prefixed(np.array([v.value]), unit)
    width = max(v.high - v.low, 1e-30)
    digits = int(np.clip(np.ceil(np.log10(max(abs(v.value), width) / width)) + 1, 2, 6)) if np.isfinite(width) else 2
    value, low, high = (numbers.figures(x * scale, digits) if np.isfinite(x) else "-" for x in (v.value, v.low, v.high))
    return f"{value} {shown}".rstrip(), f"{low} to {high}"


def effect_rows(d: Diagnosis) -> list[tuple[str, ...]]:
    """Name, node, size, interval and confidence; one row for each parameter."""
    rows: list[tuple[str, ...]] = []
    for e in d.effects:
        parameters = list(e.parameters.items()) or [("", Interval(np.nan, np.nan, np.nan))]
        for k, (name, v) in enumerate(parameters):
            value, ends = interval(v, effect_unit(d, e, name)) if name else ("", "")
            first = (
                (f"{words.noun(e.name)} ({e.name})", words.node_words(e.node, d.owner.units)) if k == 0 else ("", "")
            )
            rows.append(
                (*first, f"{name} = {value}" if name else "", ends, f"{100 * e.confidence:.0f} %" if k == 0 else "")
            )
    return rows


def effect_unit(d: Diagnosis, e: Effect, name: str) -> str:
    """Of an effect's parameter: as given, or as the node has it."""
    return e.parameters[name].unit or words.unit_at(d.record.plant, e.name, e.node, name, d.owner.units)


def parameter_rows(d: Diagnosis) -> list[tuple[str, ...]]:
    """Parameter, nominal value and where it is from, fitted value, 90 % interval, unit."""
    estimated = d.record.case.estimated
    rows: list[tuple[str, ...]] = []
    order = [n for n in FITTED[d.record.plant] if n in d.parameters]
    for name in [*order, *(n for n in d.parameters if n not in order)]:
        v, owner = d.parameters[name], d.owner.base.get(name, np.nan)
        told = f"{owner:.4g}" + (" (estimated from the recording)" if name in estimated else "")
        rows.append((name, told, f"{v.value:.4g}", f"{v.low:.4g} to {v.high:.4g}", v.unit))
    return rows


def rival_rows(d: Diagnosis) -> list[tuple[str, ...]]:
    """Found, look-alike, p-value, rms and the experiment that separates the two."""
    rows: list[tuple[str, ...]] = []
    for e in d.effects:
        for r in e.look_alikes:
            tell = TERMS[e.name].look_alikes.get(r.name, "") if e.name in TERMS else ""
            tell = tell or (TERMS[r.name].look_alikes.get(e.name, "") if r.name in TERMS else "")
            names = words.noun_at(e.name, e.node, d.owner.units), words.noun_at(r.name, r.node, d.owner.units)
            rows.append((*names, f"{r.p_value:.2g}" if r.p_value >= 1e-4 else "< 0.0001", f"{r.rms:.3g}", tell))
    return rows


def summary(d: Diagnosis) -> str:
    """Held-out figures and noise in one line, as a person reads them and as shares of the signal (nrmse)."""
    given = [d.heldout_before, d.heldout_after, d.noise_floor]
    if not d.after.terms:
        del given[1]
    sizes = [numbers.nice(words.heldout_error(d, x), words.main_unit(d)) for x in given]
    change = f"{sizes[0]} before, {sizes[1]} after" if len(given) == 3 else sizes[0]
    shares = ", ".join(f"{x:.3g}" for x in given)
    return f"Error on the part that was not fitted: {change}, where noise leaves {sizes[-1]} (nrmse {shares})."


def located(d: Diagnosis) -> str:
    """Where simulation and recording part, in one sentence."""
    at = d.located
    if at is None:
        return ""
    shown = words.channel_words(at.channel, d.owner.units)
    since = f" from {numbers.nice(at.since_s, 's', 3)} on" if at.since_s > 0 else ""
    return (
        f"{shown[:1].upper()}{shown[1:]} shows it{since}. Of the error {numbers.percent(at.share)} comes from "
        f"{words.node_words(at.node, d.owner.units)}; {words.goes(at)}."
    )


def cannot_lines(d: Diagnosis) -> list[str]:
    """Sentences on what cannot be tested, the nodes of one effect together."""
    nodes: dict[str, list[str]] = defaultdict(list)
    for entry in d.cannot_test:
        name, _, node = entry.partition(":")
        nodes[name].append(node)
    return [words.sentence(f"{name}:{found[0]}", *found[1:], units=d.owner.units) for name, found in nodes.items()]


def experiment(d: Diagnosis) -> dict[str, Any] | None:
    """What to run next: in words, what for, how, a picture of the motion, and how far each motion gets."""
    if d.experiment is None and d.verdict != AMBIGUOUS:
        return None
    given = d.experiment or {}
    said = given.get("why")
    why: dict[str, Any] = said if isinstance(said, dict) else {"words": said}
    told = words.plan(d) if d.effects or given.get("words") else "run this, then diagnose again"
    known = bool(given.get("words"))
    tell = words.separating(d) if known and d.effects else ""
    drawn = motion(given)
    tried = sorted(why.get("distance", {}).items(), key=lambda item: -item[1])
    return {
        "words": f"{told[:1].upper()}{told[1:]}.",
        "why": why.get("words") or "",
        "tell": f"How they differ: {tell}." if tell else "",
        "where": f"Put the machine where the recording began{played.room(given)}, and run the file beside this report:",
        "run": played.command(float(given["seconds"])) if "seconds" in given else "",
        "picture": svg(drawn, "motion", MOTION_ALT) if drawn else "",
        "tried": [
            *((name.replace("_", " "), f"{value:.2g}") for name, value in tried),
            *((name.replace("_", " "), f"left out: {reason}") for name, reason in why.get("refused", {}).items()),
        ],
        "text": "" if known or not given else yaml.safe_dump(plain(given), sort_keys=False),
    }


def motion(given: dict[str, Any]) -> Figure | None:
    """The reference of an experiment over its time; None where it has none."""
    reference = given.get("reference") or {}
    knots = np.array(reference.get("knots") or np.zeros((0, 2)), float)
    if len(knots) < 2:
        return None
    scale, unit = figures.prefixed(knots[:, 1], str(reference.get("unit", "")))
    figure = Figure(figsize=(7.2, 1.9), layout="constrained")
    axes = figure.add_subplot()
    figures.style(axes)
    axes.plot(knots[:, 0], scale * knots[:, 1], color=figures.AFTER, linewidth=1.0)
    repeat = reference.get("repeat")
    again = f", again every {numbers.nice(float(repeat), 's')}" if repeat else ""
    figures.label(axes, f"time, s{again}", f"reference, {unit}")
    return figure


def plain(value: Any) -> Any:
    """Numbers, words, lists and tables as YAML knows them."""
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        return value.item()
    return value if isinstance(value, str | int | float | bool | None) else str(value)


def terminal(d: Diagnosis) -> RenderableType:
    """Verdict, effects and look-alikes for the console."""
    parts: list[RenderableType] = [
        Text.assemble(
            (f" {d.verdict} ", f"bold reverse {COLOR.get(d.verdict, 'white')}"), " ", words.verdict_sentences(d)
        )
    ]
    if d.effects:
        table = Table(box=None, pad_edge=False, header_style="dim")
        for name in ("effect", "at", "size", "90 % interval", "confidence"):
            table.add_column(
                name, justify="right" if name in ("90 % interval", "confidence") else "left", overflow="fold"
            )
        for row in effect_rows(d):
            table.add_row(*map(Text, row))
        parts += [Text(), table]
        alike = [f"{look} (p {p})" for _, look, p, _, _ in rival_rows(d)]
        if alike:
            parts.append(Text(f"look-alikes: {'; '.join(alike)}", style="dim"))
    parts.append(Text(summary(d), style="dim"))
    if d.verdict == UNNAMED and d.located is not None:
        parts.append(Text(located(d), style="dim"))
    if d.cannot_test:
        parts.append(
            Text(f"{len(d.cannot_test)} effects cannot be tested with this record; the report lists them.", style="dim")
        )
    return Group(*parts)
