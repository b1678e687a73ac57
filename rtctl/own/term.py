"""Term of physics in a user's file: an effect that the emulated machine can have and `diagnose` can name.

The file has the parts of a file in plants/physics: XSettings with the key `node`, XParams, build, compiled functions,
and X = Term(...) with the effect's text, sites and look-alikes. The lines `act` name the file by its own name:
windage.torque({p}, ...) in windage.py.
"""

import re
from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from pydantic import create_model

from rtctl.config.errors import nearest
from rtctl.idiom import Settings
from rtctl.own.files import Source, load, read, split
from rtctl.own.parts import upper
from rtctl.plants.physics import TERMS, Term, by_kind
from rtctl.plants.physics.place import PLANTS
from rtctl.plants.physics.term import SITES

registered: dict[str, Source] = {}  # ./windage.py:Windage -> its source


def register(sources: list[Source]) -> None:
    """Add terms to the library under their names in a config, ./windage.py:Windage."""
    for source in dict.fromkeys(sources):
        TERMS[source.spec] = own_term(source)
        registered[source.spec] = source


def register_file(spec: str, folder: Path) -> None:
    """Add the term of a file named on the command line to the library. Raises OwnError."""
    file, name = split(spec)
    register([Source(file, name, read(file, folder))])


def texts(names: Iterable[str]) -> dict[str, str]:
    """Texts of the user files among these terms, as in a config's `own`: file -> text."""
    return {registered[name].file: registered[name].text for name in names if name in registered}


def sizes(name: str) -> dict[str, tuple[float, float]]:
    """Parameters of a user's term that a fit may change, with their typical range; the first is the effect's size."""
    return TERMS[name].typical if name in registered else {}


@lru_cache(maxsize=64)
def own_term(source: Source) -> Term:
    """Term of a file, as in the library. Raises OwnError for a missing or unsuitable part."""
    module = load(source)
    name = upper(source.name)
    found = getattr(module, name, None)
    if not isinstance(found, Term):
        there = [n for n, value in vars(module).items() if isinstance(value, Term)]
        near = nearest(name, there) or (there[0] if len(there) == 1 else None)
        hint = f"did you mean {source.file}:{near}?" if near else f"write {name} = Term(name=..., words=..., ...)"
        raise source.error(source.line_of(name), f"there is no term {name}; {hint}")
    line = source.line_of(name)
    for site in found.act:
        base, _, kind = site.partition(":")
        if base not in SITES or (kind and kind not in (*PLANTS, "described")):
            known = ", ".join(SITES)
            raise source.error(line, f"{name}.act: there is no site '{site}'; it is {known}, or e.g. force:ivu")
    if not by_kind(found):
        asked = " or ".join(" ".join((stand.element, *sorted(stand.needs))) for stand in found.stands) or "nothing"
        raise source.error(line, f"{name}.stands: no machine has an element for it; it asks for {asked}")
    for parameter, (low, high) in found.typical.items():
        if parameter not in found.settings.model_fields or not 0 < low < high:
            raise source.error(
                line, f"{name}.typical: {parameter}: ({low:g}, {high:g}) should be a setting's lowest and highest size"
            )
    if "node" not in found.settings.model_fields:
        raise source.error(
            source.line_of(found.settings.__name__), f"{found.settings.__name__} has no key `node`; write node: str"
        )
    stem = re.escape(Path(source.file).stem)
    act = {site: re.sub(rf"(?<![\w.]){stem}\.", f"{module.__name__}.", lines) for site, lines in found.act.items()}
    return replace(found, name=source.spec, settings=_named(found.settings, source.spec), act=act, since=0)


def _named(settings: type[Settings], spec: str) -> type[Settings]:
    """The file's settings with the key `term` set to the name in a config."""
    word: Any = Literal[spec]
    return create_model(settings.__name__, __base__=settings, term=(word, spec))
