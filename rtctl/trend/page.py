"""Page of a trend, one HTML file: changes, pictures by machine, recordings without an estimate."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from rtctl import __version__
from rtctl.config.errors import UserError
from rtctl.config.files import write_text
from rtctl.diagnose.answer.page import svg
from rtctl.trend import figures
from rtctl.trend.change_points import FEWEST, SURE
from rtctl.trend.series import LEAST, TOLD, Judged
from rtctl.trend.trend import summary

PANELS = 12  # of a machine; series with changes come first
MOST_ERRORS = 50


def write(path: Path, judged: Sequence[Judged], rows: Sequence[dict[str, Any]], least: float = LEAST) -> Path:
    """Write the page; its path. Raises UserError where the disk does not take it."""
    try:
        write_text(path, html(judged, rows, least))
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None
    return path


def html(judged: Sequence[Judged], rows: Sequence[dict[str, Any]], least: float = LEAST) -> str:
    """The page as one text."""
    env = Environment(
        loader=PackageLoader("rtctl.trend", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    found = summary(judged, list(rows), least)
    return env.get_template("trend.html.j2").render(
        title=", ".join(found["machines"][:3]) + (" and more" if len(found["machines"]) > 3 else ""),
        verdict=verdict(found),
        alarm=bool(found["alarms"]),
        changes=[change_row(change) for change in found["changes"]],
        machines=[machine_part(number, name, judged, least) for number, name in enumerate(found["machines"])],
        errors=[(Path(e["folder"]).name, e["error"]) for e in found["errors"][:MOST_ERRORS]],
        more_errors=max(len(found["errors"]) - MOST_ERRORS, 0),
        rule=(
            f"A change is listed from a probability of {100 * SURE:.0f} % on, and is an alarm where it is larger than "
            f"{100 * least:.3g} % by the near end of its interval. A series has {FEWEST} estimates at least."
        ),
        footer=f"rtctl {__version__}; intervals are of 90 %.",
    )


def verdict(found: dict[str, Any]) -> str:
    """Result of the trend in one or two sentences."""
    count, machines = found["records"], len(found["machines"])
    words = f"{count} recordings of {machines} machine{'s' if machines != 1 else ''}. "
    alarmed = sorted({change["machine"] for change in found["changes"] if change["alarm"]})
    if not alarmed:
        slight = len(found["changes"])
        return words + ("No change." if not slight else f"No alarm; {slight} slight changes.")
    return words + f"Changed: {', '.join(alarmed)}."


def change_row(change: dict[str, Any]) -> tuple[list[str], bool]:
    """Row of the table of changes, and whether it is an alarm."""
    low, high = (f"{100 * end:+.3g}" for end in change["interval"])
    drift = change["kind"] == "drift"
    return [
        change["machine"],
        change["number"] if change["of"] == "parameter" else f"residual of {change['number']}",
        "drift" if drift else "shift",
        "over all" if drift else change["from"],
        "" if drift else f"{change['between'][0]} to {change['between'][1]}",
        f"{100 * change['change']:+.3g} % ({low} to {high})",
        f"{100 * min(change['probability'], 0.9999):.4g} %",
    ], change["alarm"]


def machine_part(number: int, name: str, judged: Sequence[Judged], least: float) -> dict[str, Any]:
    """Pictures of one machine, and the numbers that its recordings do not determine."""
    mine = [one for one in judged if one.series.machine == name]
    looked = sorted((one for one in mine if one.series.looked_at), key=lambda one: not one.changes)
    return {
        "name": name,
        "svg": svg(figures.panels(looked[:PANELS], least), f"m{number}", f"Estimates of {name} over time.")
        if looked
        else "",
        "more": max(len(looked) - PANELS, 0),
        "untold": ", ".join(
            f"{one.series.name} ({100 * one.series.told:.0f} %)" for one in mine if not one.series.looked_at
        ),
        "told": f"{100 * TOLD:.0f} %",
    }
