"""`rtctl physics`: the terms of physics that a plant's `physics:` list can hold."""

import sys
import textwrap
from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import complete

app = typer.Typer(add_completion=False)
WIDTH = 100
SCALES = {  # scale of a term's parameter -> its text; a typical size is a multiple of it
    "dry": "the base model's dry friction",
    "force": "the force of the drive",
    "speed": "the usual speed",
    "travel": "the travel",
    "contact": "what the contact carries",
    "stiffness": "the spring's stiffness",
    "inertia": "the inertia that is there",
    "force/speed": "force over speed",
    "force/travel": "force over travel",
    "stiffness/stretch^2": "the stiffness over the stretch squared",
}


@app.command()
def physics(
    term: Annotated[
        str | None, typer.Argument(metavar="[TERM]", help="Explain this one.", autocompletion=complete.terms)
    ] = None,
    plot: Annotated[Path | None, typer.Option("--plot", metavar="FILE.png", help="Draw the term here as well.")] = None,
) -> None:
    """List the terms of physics, or explain one: equation, parameters, where it can stand, what it is mistaken for, and
    its curve as it comes out of its compiled code.

    Examples:

      rtctl physics

      rtctl physics friction.stribeck

      rtctl physics friction.stribeck --plot stribeck.png
    """
    from rtctl.config.errors import UserError, nearest
    from rtctl.plants.physics import TERMS

    if term is None:
        if plot is not None:
            raise UserError("--plot draws one term; say which: rtctl physics TERM --plot FILE.png")
        width = max(map(len, TERMS)) + 2
        for name, entry in TERMS.items():
            typer.echo(f"{name:{width}}{entry.words}")
        return
    if term not in TERMS:
        near = nearest(term, TERMS) or next((name for name in TERMS if name.rpartition(".")[2] == term), None)
        raise UserError(f"no term '{term}'; " + (f"did you mean '{near}'?" if near else "`rtctl physics` lists them"))
    if plot is not None and plot.suffix.lower() != ".png":
        raise UserError(f"--plot {plot}: the picture is a PNG; name it {plot.with_suffix('.png')}")
    typer.echo("\n".join(explain(TERMS[term])))
    from rtctl.cli import portrait as show
    from rtctl.plants.physics.portrait import portrait

    curve = portrait(TERMS[term])
    typer.echo(
        "\n".join(["", f"  {show.sizes(curve)}; in sparse dots: without it", "", *show.lines(curve, speaks_braille())])
    )
    if plot is not None:
        show.picture(curve, plot)


def speaks_braille() -> bool:
    """Whether standard output can encode the braille characters of a curve."""
    try:
        "\u28ff".encode(sys.stdout.encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True


def explain(term: Any) -> list[str]:
    """Lines of text that explain one term."""
    from rtctl.plants.element import GENERAL
    from rtctl.plants.physics import by_kind

    lines = [
        term.name,
        f"  {term.words}",
        "",
        f"  equation  {term.equation}",
        f"  source    {term.source}",
        "",
        "  parameters",
    ]
    for name, field in term.settings.model_fields.items():
        if name not in ("term", "node"):
            lines += _item(name, _parameter(field, term.typical.get(name), term.scale.get(name)))
    lines += ["", "  nodes"]
    for plant, nodes in by_kind(term).items():
        lines += _item(plant, ", ".join(nodes))
    for stand in term.stands:
        if GENERAL in stand.needs:
            asked = " ".join(sorted(stand.needs - {GENERAL}))
            lines += _item("described machines", f"each {stand.element}{f' with the traits: {asked}' if asked else ''}")
    if term.look_alikes:
        lines += ["", "  mistaken for, and the experiment that tells them apart"]
        for rival, experiment in term.look_alikes.items():
            lines += _item(rival, experiment)
    if term.check:
        indent = " " * 4
        wrapped = textwrap.wrap(term.check, WIDTH, initial_indent=indent, subsequent_indent=indent)
        lines += ["", "  on the machine", *wrapped]
    return lines


def _parameter(field: Any, typical: tuple[float, float] | None, scale: str | None) -> str:
    """Text on one parameter: help, unit, typical range as a multiple of its scale, and default."""
    from typing import get_args

    unit = (field.json_schema_extra or {}).get("unit", "")
    words = field.description or " | ".join(map(str, get_args(field.annotation)))
    of = f" times {SCALES.get(scale, scale)}" if scale else ""
    met = f"; {typical[0]:g} to {typical[1]:g}{of} is typical" if typical else ""
    default = "" if field.is_required() else f"; {field.default} if absent"
    return words + (f" [{unit}]" if unit else "") + met + default


def _item(name: str, text: str) -> list[str]:
    return textwrap.wrap(
        f"{name:20} {text}", WIDTH, initial_indent="    ", subsequent_indent=" " * 25, break_on_hyphens=False
    )
