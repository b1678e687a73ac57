"""Config of an experiment for `rtctl run`, and its instructions in words."""

import math
import re
import textwrap
from collections.abc import Sequence
from typing import Any

from pydantic import ValidationError

from rtctl.config.errors import UserError
from rtctl.config.load import set_path, to_yaml
from rtctl.diagnose.answer.results import EXPERIMENT
from rtctl.diagnose.answer.si_format import span
from rtctl.idiom import Settings
from rtctl.own.files import OwnError

WIDTH = 110  # characters of a comment line
PAIR = re.compile(r"- - (\S+)\n +- (\S+)$(?!\n +- [^-])", re.M)  # a knot over two lines
PLAYED = ("reference", "excitation")  # keys of a config that prescribe the motion


def text(data: dict[str, Any], experiment: dict[str, Any], names: Sequence[str], seconds: float, own: bool) -> str:
    """Config `data` with the motion of an experiment, as YAML under a head with its purpose.

    `names` are the separated effects, `seconds` the duration where the experiment has none, `own` whether the config is
    that of a recording by rtctl. Raises UserError where the config does not accept the experiment.
    """
    from rtctl import machines
    from rtctl.config.fields import Shape, fill

    data = plain(data)
    try:
        kind, data = machines.widened(data)
        settings = kind.model_validate(fill(Shape(kind, model=kind), data))
        settings, seconds = playing(settings, experiment, seconds)
    except (OwnError, ValidationError) as error:
        raise UserError(f"the config of the machine cannot play the experiment: {error}") from None
    if not own:  # the whole machine is emulated: no real-time clock is needed
        settings = set_path(settings, "loop.mode", "fused")
    return _head(experiment, names, seconds, own) + PAIR.sub(r"- [\1, \2]", to_yaml(settings))


def playing(config: Any, experiment: dict[str, Any], seconds: float) -> tuple[Any, float]:
    """Config that plays an experiment, and its duration, s."""
    for key in PLAYED:
        if experiment.get(key) is not None:
            given = {name: value for name, value in experiment[key].items() if name != "unit"}  # the machine has one
            config = set_path(config, key, plain(given))
    return config, float(experiment.get("seconds") or seconds)


def _head(experiment: dict[str, Any], names: Sequence[str], seconds: float, own: bool) -> str:
    """Comment lines at the top of the file of an experiment: motion, purpose and how to run it."""
    given = experiment.get("why")
    why: dict[str, Any] = given if isinstance(given, dict) else {"words": given}
    told = [
        f"The experiment to run next. {experiment.get('words') or ''}",
        why.get("words") or f"It separates {' from '.join(names)}.",
        f"Put the machine where the recording began{room(experiment)}, run `{command(seconds)}` and diagnose that "
        "recording.",
    ]
    if not own:
        told.append(
            "rtctl did not make the recording. Everything in this file but the reference stands in for the recorded "
            "controller: play the reference on your own controller."
        )
    lines = [line for words in told for line in wrapped(" ".join(str(words).split()))]
    distances = sorted(why.get("distance", {}).items(), key=lambda item: -item[1])
    if distances:
        lines.append("Expected difference between the rival explanations, in units of the noise, by motion:")
        lines += [f"    {name:18} {value:.3g}" for name, value in distances]
        lines += [f"    {name:18} left out: {reason}" for name, reason in why.get("refused", {}).items()]
    return "".join(f"# {line}\n" for line in lines)


def wrapped(text: str) -> list[str]:
    """Lines of a comment; text in backticks is not broken and can be copied."""
    kept = re.sub("`[^`]*`", lambda found: found[0].replace(" ", "\0"), text)
    return [line.replace("\0", " ") for line in textwrap.wrap(kept, WIDTH, break_on_hyphens=False)]


def command(seconds: float) -> str:
    """Command that runs an experiment of `seconds` s."""
    return f"rtctl run {EXPERIMENT} --for {math.ceil(seconds)}s"


def room(experiment: dict[str, Any]) -> str:
    """Room that the machine needs, in words; "" where the experiment has no travel."""
    travel = experiment.get("limits", {}).get("travel")
    if travel is None:
        return ""
    unit = (experiment.get("reference") or {}).get("unit", "")
    return f", with room of {span(float(travel[0]), float(travel[1]), unit)} around it"


def plain(value: Any) -> Any:
    """Plain data for YAML."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return plain(value.tolist()) if hasattr(value, "tolist") else value


def terms(entries: Sequence[Settings], known: int) -> list[tuple[str, str, str]]:
    """Rows (key, "-", value) of the terms of a `physics:` list after the first `known`."""
    rows = []
    for number, term in enumerate(entries[known:], known):
        values = {k: v for k, v in term.model_dump().items() if k not in ("term", "node")}
        shown = ", ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in values.items())
        rows.append((f"plant.physics.{number}", "-", f"{term.term} at {term.node}: {shown}"))  # type: ignore[attr-defined]
    return rows
