"""Words and numbers of an improvement, for the console, the report and a program."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rtctl import machines
from rtctl.design.margins import Margins
from rtctl.diagnose.answer.si_format import nice
from rtctl.improve.improve import Improved
from rtctl.improve.played import Figures
from rtctl.improve.remedy import Tried
from rtctl.machines.base import DESCRIBED

Row = tuple[str, str, str, str]
SMALL = 0.02  # relative change of a figure, up to which it is not mentioned


def headline(r: Improved) -> str:
    """The result in one sentence."""
    kept = [one for one in r.tried if one.kept]
    if not kept:
        return "No remedy makes this machine better; the config stays as it is."
    unit = unit_of(r.config)
    before, after = r.before.figures.rms, r.after.figures.rms
    many = f"{len(kept)} remed{'ies' if len(kept) > 1 else 'y'}"
    return (
        f"The tracking error of the {r.judge.words} falls by {100 * r.reduction:.0f} %, from {nice(before, unit)} to "
        f"{nice(after, unit)} rms, by {many}."
    )


def proof(r: Improved) -> str:
    """Sentence on the method of the proof."""
    return (
        f"Proved on the emulated fitted model, same reference, {r.after.t[-1]:.3g} s; each remedy was tried alone, at "
        "the size that was found and at both ends of its interval, with the margins of the loop."
    )


def unit_of(config: Any) -> str:
    """Unit of the reference."""
    return str(machines.build(config).unit)


def command_of(config: Any) -> str:
    """Unit of the command."""
    if config.kind != DESCRIBED:
        return "V"
    from rtctl.machines.described_parts import parts_of

    return parts_of(config).command


def rows(config: Any, before: Figures, after: Figures, margins: Sequence[Margins | None] = ()) -> list[Row]:
    """Figures before and after, with their changes."""
    unit, command = unit_of(config), command_of(config)
    out = [
        _row("tracking error, rms", before.rms, after.rms, unit),
        _row("tracking error, most", before.most, after.most, unit),
        _row("final error", before.final, after.final, unit),
        _row("overshoot", before.overshoot, after.overshoot, "%"),
        _row("settling", before.settling, after.settling, "s"),
        _row("command, rms", before.effort, after.effort, command),
    ]
    if margins and margins[0] is not None and margins[1] is not None:
        out += [
            _row("gain margin", margins[0].GM, margins[1].GM, "dB"),
            _row("phase margin", margins[0].PM, margins[1].PM, "deg"),
        ]
    return out


def _row(name: str, before: float, after: float, unit: str) -> Row:
    change = ""
    if np.isfinite(before) and np.isfinite(after) and before:
        change = f"{100 * (after / before - 1):+.0f} %"
    return name, _value(before, unit), _value(after, unit), change


def _value(x: float, unit: str) -> str:
    if not np.isfinite(x):
        return {"s": "does not settle", "dB": "no limit"}.get(unit, "-")
    return f"{x:.1f} {unit}" if unit in ("dB", "deg", "%") else nice(x, unit, 3)


def kept_rows(r: Improved) -> list[tuple[str, ...]]:
    """Remedies that were put in."""
    unit = unit_of(r.config)
    return [
        (one.remedy.title, one.remedy.against, one.remedy.size, nice(one.before, unit, 3), nice(one.after, unit, 3))
        for one in r.tried
        if one.kept
    ]


def left_rows(r: Improved) -> list[tuple[str, str, str]]:
    """Remedies that were left out, with the reason."""
    return [(one.remedy.title, one.remedy.against, one.reason) for one in r.tried if not one.kept] + [
        ("none in a law", effect.words, "the sensor is to be repaired")
        for effect in r.found.effects
        if hopeless(effect)
    ]


def hopeless(effect: Any) -> bool:
    """Whether no law can compensate an effect."""
    return tuple(effect.term.remedies) == ("sensor",)


def notes(r: Improved) -> list[str]:
    """Conditions on the machine for the kept remedies."""
    return list(
        dict.fromkeys(f"{one.remedy.title}: {one.remedy.note}." for one in r.tried if one.kept and one.remedy.note)
    )


def given_up(r: Improved) -> list[str]:
    """Figures that are worse than before."""
    worse = []
    for name, before, after, change in rows(
        r.config, r.before.figures, r.after.figures, (r.margins_before, r.margins_after)
    ):
        margin = name.endswith("margin")
        if change and not (-100 * SMALL < float(change.split()[0]) < 100 * SMALL) and margin == change.startswith("-"):
            worse.append(f"{name}: {before} to {after}")
    return worse


def as_json(r: Improved) -> dict[str, Any]:
    """The result for a program."""
    return {
        "headline": headline(r),
        "source": r.found.source,
        "body": r.judge.words,
        "unit": unit_of(r.config),
        "reduction": r.reduction,
        "before": r.before.figures._asdict(),
        "after": r.after.figures._asdict(),
        "margins_before": None if r.margins_before is None else r.margins_before._asdict(),
        "margins_after": None if r.margins_after is None else r.margins_after._asdict(),
        "kept": [_tried(one) for one in r.tried if one.kept],
        "left_out": [{"remedy": a, "against": b, "reason": c} for a, b, c in left_rows(r)],
        "notes": notes(r),
        "given_up": given_up(r),
    }


def _tried(one: Tried) -> dict[str, Any]:
    return {
        "remedy": one.remedy.kind,
        "title": one.remedy.title,
        "against": one.remedy.against,
        "size": one.remedy.size,
        "rms_before": one.before,
        "rms_after": one.after,
        "values": dict(one.values),
    }
