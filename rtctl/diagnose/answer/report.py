"""Report of a diagnosis of a described machine: one self-contained HTML file, and a table for the terminal."""

import re
from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from rtctl.case.start import is_start
from rtctl.diagnose.answer import figures, played, runner_up, words
from rtctl.diagnose.answer import si_format as numbers
from rtctl.diagnose.answer.answer import GraphDiagnosis
from rtctl.diagnose.answer.missing_force import machine_words
from rtctl.diagnose.answer.page import COLOR, Picture, interval, svg
from rtctl.diagnose.answer.phrases import need, noun, phrase_of
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED, Interval
from rtctl.plants.physics import TERMS

LEAST = 1e-3  # least probability of a reported look-alike without a known separating experiment
ONE_LINE = 36  # characters of an effect with its name that fit on one line of a console of 80 characters
MOST_RIVALS = 4  # look-alikes of one effect in the table
PICTURES = {
    "missing": (figures.missing_force, {
        "": "Force or reading that the model without the effect lacks, along the axis of the effect: means with 95 % "
            "bands. The line is the law that was found.",
        UNNAMED: "Force or reading that the model lacks, along the axis on which it depends: means with 95 % bands. "
                 "The line is the free function that fits best.",
        NOTHING: "Force that the model lacks: means with 95 % bands. The bands contain zero where nothing is missing.",
    }),
    "heldout": (figures.heldout, {
        "": "Residual of each sensor on held-out rows, in units of the noise of its counts or steps. The grey band "
            "contains 95 % of this noise.",
    }),
    "posterior": (figures.posterior, {
        "": "Posterior probability, mean over resampled segments. An effect without a name is a free function of one "
            "axis. A number such as 1e-9 is the probability relative to the first answer.",
    }),
    "runner_up": (figures.runner_up, {
        "": "Gain in log probability of the answer over the next likeliest one, by part of the recording. A part below "
            "zero supports the next likeliest answer. 2.3 nats are odds of ten to one.",
    }),
    "parameters": (figures.parameters, {
        "": "Deviation of the fitted numbers from the nominal ones, with 90 % intervals. A wrong number is not missing "
            "physics.",
    }),
}  # fmt: skip


MISSING = {
    NAMED: "What is missing, and the law that was found",
    AMBIGUOUS: "What is missing, and the likeliest law",
    UNNAMED: "What is missing, and the free function that fits best",
    NOTHING: "What is missing: no force with a pattern",
}


class Row(NamedTuple):
    """Parameter of the machine in the table."""

    path: str
    nominal: str
    fitted: str
    interval: str
    unit: str
    untold: bool


def html(d: GraphDiagnosis) -> str:
    """Text of the HTML report."""
    env = Environment(
        loader=PackageLoader("rtctl.diagnose.answer", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    r = d.record
    begin, end = d.heldout.rows
    return env.get_template("report.html.j2").render(
        d=d,
        title=f"{machine_words(r.case.machine)}, {r.t[-1] - r.t[0]:.4g} s at {numbers.nice(1 / r.dt, 'Hz', 3)}",
        headline=d.headline,
        missing=MISSING[d.verdict],
        summary=summary(d),
        effects=effect_rows(d),
        checks=checks(d),
        why=reason(d),
        next=runner_up.sentence(d),
        rivals=rival_rows(d),
        instead=instead(d),
        parameters=parameter_rows(d),
        cannot=cannot_rows(d),
        warnings=d.as_json()["warnings"],
        figures=pictures(d),
        together=together(d),
        footer=f"rtctl diagnose, {d.seconds:.1f} s; {sum(len(one.t) for one in d.records)} rows, prediction fitted to "
        f"rows {begin} to {end}{'' if len(d.records) == 1 else f' of {r.name}'}.",
    )


def together(d: GraphDiagnosis) -> str:
    """Sentence on several recordings of one machine; "" for one recording."""
    if len(d.records) == 1:
        return ""
    names = [r.name for r in d.records]
    return (
        f"{len(names)} recordings of one machine: {', '.join(names[:-1])} and {names[-1]}. Numbers and effects are "
        f"shared; the figures show {names[0]}."
    )


def pictures(d: GraphDiagnosis) -> dict[str, Picture]:
    """Figures of the diagnosis with captions, by name."""
    found = {}
    for name, (draw, captions) in PICTURES.items():
        figure = draw(d)
        if figure is not None:
            caption = captions.get(d.verdict, captions[""])
            found[name] = Picture(svg(figure, name, f"{caption} {d.headline}"), caption)
    return found


def summary(d: GraphDiagnosis) -> str:
    """Held-out errors in one sentence, as shares of the recorded motion."""
    shown = [d.heldout.before, d.heldout.after, d.heldout.floor]
    floor = numbers.percent(shown[2])
    if not d.decided.best.names:
        error = numbers.percent(shown[0])
        return f"Error on rows that were not fitted: {error} of the motion; noise alone gives {floor}."
    one, two = (numbers.percent(x) for x in shown[:2])
    return f"Error on rows that were not fitted: {one} of the motion before, {two} after; noise alone gives {floor}."


def effect_rows(d: GraphDiagnosis) -> list[tuple[str, ...]]:
    """Rows (name, node, size, interval, confidence), one for each parameter of the effects."""
    rows: list[tuple[str, ...]] = []
    for e in d.effects:
        first = f"{noun(e.name)} ({e.name})", words.here(d.record.case.machine, e.node)
        for k, (name, v) in enumerate(list(e.parameters.items()) or [("", Interval(np.nan, np.nan, np.nan))]):
            value, ends = interval(v, v.unit) if name else ("", "")
            told = f"{name} = {value}" if name else ""
            ends = ends if v.high > v.low else ""
            rows.append((*(first if k == 0 else ("", "")), told, ends, f"{100 * e.confidence:.0f} %" if k == 0 else ""))
    return rows


def checks(d: GraphDiagnosis) -> list[str]:
    """Checks for a mechanic, one sentence for each effect."""
    machine = d.record.case.machine
    found = [(words.here(machine, e.node), TERMS[e.name].check) for e in d.effects if TERMS[e.name].check]
    return list(dict.fromkeys(f"{at[:1].upper()}{at[1:]}: {line}" for at, line in found))


def reason(d: GraphDiagnosis) -> str:
    """Reason of a verdict without a name; else the remark on the names."""
    if not d.decided.why:
        return ""
    if d.verdict not in (UNNAMED, NOTHING):
        text = told_names(d, d.decided.why)
        return f"{text[:1].upper()}{text[1:]}."
    return f"The verdict is {d.verdict}: {told_names(d, d.decided.why)}."


def told_names(d: GraphDiagnosis, text: str) -> str:
    """Sentence with each "term:node" in words, also of rejected models."""
    machine = d.record.case.machine

    def told(found: re.Match[str]) -> str:
        return words.called(machine, found[0]) if found[1] in TERMS else found[0]

    return re.sub(r"([a-z_]+\.[a-z_]+):[\w-]+", told, text)


def rival_rows(d: GraphDiagnosis) -> list[tuple[str, ...]]:
    """Rows (effect, look-alike, probability, experiment that separates the two)."""
    machine = d.record.case.machine
    rows = []
    for e in d.effects:
        for r in e.look_alikes:
            tell = TERMS[e.name].look_alikes.get(r.name, "") or TERMS[r.name].look_alikes.get(e.name, "")
            p = f"{100 * r.probability:.1f} %" if r.probability >= LEAST else "< 0.1 %"
            if r.probability < LEAST and not tell:
                continue
            names = (words.called(machine, f"{x.name}:{x.node}") for x in (e, r))
            rows.append((*names, p, tell))
    return rows[: MOST_RIVALS * len(d.effects)]


def instead(d: GraphDiagnosis) -> list[str]:
    """Sentences on the next recording where several answers are probable."""
    if d.experiment is not None:
        return run_next(d.experiment)
    return [*([d.planned.untold] if d.planned.untold else []), *without_motion(d)]


def run_next(experiment: dict[str, Any]) -> list[str]:
    """Sentences on an experiment: motion, purpose, how to run it, and the distance by each tried motion."""
    why, seconds = experiment["why"], float(experiment["seconds"])
    tried = sorted(why["distance"].items(), key=lambda item: -item[1])
    far = "; ".join(f"{name.replace('_', ' ')} {value:.2g}" for name, value in tried)
    return [
        experiment["words"],
        why["words"],
        f"Put the machine where the recording began{played.room(experiment)}, run "
        f"`{played.command(seconds)}` and diagnose both recordings together.",
        f"Expected difference between the rival explanations, in units of the noise, by motion: {far}.",
        *(f"{name.replace('_', ' ')}: left out, {reason}." for name, reason in why["refused"].items()),
    ]


def without_motion(d: GraphDiagnosis) -> list[str]:
    """Sentences on the next recording without a planned motion."""
    if d.verdict == AMBIGUOUS:
        names = list(dict.fromkeys(e.name for e in d.effects))
        pairs = [(a, b) for a in names for b in names if b in TERMS[a].look_alikes]
        lines = [f"{noun(a)} or {noun(b)}: {TERMS[a].look_alikes[b]}" for a, b in pairs[:2]]
        return lines or [f"To show {noun(n)}, record {need(f'{n}:')}." for n in names]
    if d.verdict == UNNAMED and d.located is not None:
        at = words.here(d.record.case.machine, d.located.node)
        machine = d.record.case.machine
        blind = [
            b for b in machine.bodies if not machine.is_frame(b) and b not in {s.body for s in machine.sensors.values()}
        ]
        lines = [
            f"The missing effect is at {at} and depends on the {d.located.axis}. Vary only the {d.located.axis} there, "
            "slowly and in both directions.",
        ]
        if blind:
            at = words.here(machine, blind[0])
            lines.append(f"A sensor at {at} would show on which side of its joints the effect acts.")
        return lines
    return []


def parameter_rows(d: GraphDiagnosis) -> list[Row]:
    """Rows of the fitted parameters with their nominal values."""
    rows = []
    for path, v in d.parameters.items():
        start = is_start(path)
        scale, unit = _scaled(v.value if start else d.nominal[path], v.unit)
        low, high = sorted((v.low, v.high))
        nominal, fitted = (numbers.figures(scale * x, 4) for x in (d.nominal[path], v.value))
        nominal = "" if start else nominal
        ends = " to ".join(numbers.figures(scale * x, 3) for x in (low, high))
        rows.append(Row(path, nominal, fitted, ends, unit, figures.untold(d, path)))
    return rows


def _scaled(value: float, unit: str) -> tuple[float, str]:
    power = numbers.prefix(value, unit, 3)
    return 10.0**-power, numbers.PREFIXES[power] + unit


def cannot_rows(d: GraphDiagnosis) -> list[tuple[str, str, str]]:
    """Rows (effect, nodes, motion that a recording needs) of the untestable effects."""
    nodes: dict[str, list[str]] = defaultdict(list)
    for entry in d.cannot_test:
        name, _, node = entry.partition(":")
        nodes[name].append(words.here(d.record.case.machine, node).removeprefix("the "))
    return [(noun(n), ", ".join(there), phrase_of(n).need if phrase_of(n) else "") for n, there in nodes.items()]  # type: ignore[union-attr]


def terminal(d: GraphDiagnosis) -> RenderableType:
    """Verdict, effects, look-alikes and errors for the console."""
    parts: list[RenderableType] = [
        Text.assemble((f" {d.verdict} ", f"bold reverse {COLOR.get(d.verdict, 'white')}"), " ", d.headline)
    ]
    if together(d):
        parts.append(Text(together(d), style="dim"))
    if d.effects:
        table = Table(box=None, pad_edge=False, header_style="dim")
        for name in ("effect", "at", "size", "90 % interval", "confidence"):
            right = name in ("90 % interval", "confidence")
            table.add_column(name, justify="right" if right else "left", overflow="fold", no_wrap=name == "effect")
        for first, *others in effect_rows(d):  # the name of an effect is not broken
            table.add_row(*map(Text, (first.replace(" (", "\n(") if len(first) > ONE_LINE else first, *others)))
        parts += [Text(), table]
    alike = [f"{look} ({p})" for _, look, p, _ in rival_rows(d)[:MOST_RIVALS] if not p.startswith("<")]
    if alike and d.verdict in (NAMED, AMBIGUOUS):
        parts.append(Text(f"look-alikes: {'; '.join(alike)}", style="dim"))
    parts += [Text(line, style="dim") for line in checks(d)]
    parts.append(Text(summary(d), style="dim"))
    if reason(d) and d.verdict == UNNAMED:
        parts.append(Text(reason(d), style="dim"))
    parts += [Text(line, style="dim") for line in instead(d)]
    if d.cannot_test:
        many = len(d.cannot_test)
        text = f"{many} effect{'s' * (many > 1)} cannot be tested with this recording; the report says what to record."
        parts.append(Text(text, style="dim"))
    return Group(*parts)
