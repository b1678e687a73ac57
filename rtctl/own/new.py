"""New user files from a template: a file that works, its test, and a config that uses it.

The files in `templates` run unchanged; only names and units are replaced.
"""

import importlib.util
import keyword
import re
from importlib import resources
from pathlib import Path
from typing import NamedTuple

from rtctl.config.errors import UserError, nearest
from rtctl.own.new_like import SHIPPED
from rtctl.own.parts import camel, upper
from rtctl.plants.physics.place import PLANTS

KINDS = ("law", "plant", "term")  # of files; machines and configs: see new_like.py
MACHINES = tuple(PLANTS)
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
POSITION = re.compile(r"^  position:.*\n(?:    .*\n)+", re.MULTILINE)
PHYSICS = re.compile(r"^  physics:.*\n?", re.MULTILINE)


class Written(NamedTuple):
    """Files of a new law, plant or term."""

    source: Path
    test: Path
    config: Path


def write(kind: str, name: str, machine: str, folder: Path) -> Written:
    """Write the files of a new `kind` called `name` for a machine. Raises UserError, and writes nothing, where a file
    exists or a name is invalid."""
    for word, known, what in ((kind, (*KINDS, *SHIPPED), "kind"), (machine, MACHINES, "machine")):
        if word not in known:
            near = nearest(word, known)
            raise UserError(
                f"{what} '{word}': it is {', '.join(known)}" + (f"; did you mean '{near}'?" if near else "")
            )
    stem = _stem(name)
    files = Written(folder / f"{stem}.py", folder / f"test_{stem}.py", folder / f"{stem}.yaml")
    there = [str(path) for path in files if path.exists()]
    if there:
        raise UserError(
            f"{', '.join(there)}: there already, and nothing is overwritten; take another name or --into DIR"
        )
    template = f"my_{kind}_{machine}.py" if kind == "plant" else f"my_{kind}.py"
    texts = (
        _renamed(_template(template), kind, stem, machine),
        _renamed(_template(f"test_{template}"), kind, stem, machine),
        _config(kind, stem, machine),
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, text in zip(files, texts, strict=True):
            with path.open("x", encoding="utf-8") as file:
                file.write(text)
    except OSError as error:
        raise UserError(f"{error.filename}: cannot be written: {error.strerror}") from None
    return files


def _stem(name: str) -> str:
    """File name of MyLaw or my_law, without suffix."""
    if not NAME.fullmatch(name) or name.endswith("_"):
        raise UserError(f"'{name:.60}' is no name for a Python file; write e.g. feedforward or my_law")
    stem = upper(name).lower()
    if keyword.iskeyword(stem) or importlib.util.find_spec(stem) is not None:
        raise UserError(f"'{stem}' is the name of something in Python already, which the file would hide; take another")
    return stem


def _template(file: str) -> str:
    return (resources.files("rtctl.own") / "templates" / file).read_text(encoding="utf-8")


def _renamed(text: str, kind: str, stem: str, machine: str) -> str:
    """Text of the template with the new name and the unit of the machine's position."""
    for old, new in (
        (f"my_{kind}", stem),
        (camel(f"my_{kind}"), camel(stem)),
        (f"MY_{kind.upper()}", upper(camel(stem))),
        (f"My {kind}", stem.replace("_", " ").capitalize()),
    ):
        text = text.replace(old, new)
    if kind == "term":
        text = text.replace('"reel1"', f'"{PLANTS[machine].OWN.node}"', 1) if "import pytest" in text else text
    if kind == "law":
        text = re.sub(r"\brad\b", PLANTS[machine].OWN.unit, text)
        text = text.replace("quantity(40.0", f"quantity({PLANTS[machine].OWN.cutoff}")
    return text


def _config(kind: str, stem: str, machine: str) -> str:
    """Text of the machine's config with the new file in it."""
    text = (resources.files("rtctl.configs") / f"{machine}.yaml").read_text(encoding="utf-8")
    head, _, rest = text.partition("\n")
    text = f"{head}, with the {kind} of {stem}.py\n{rest}".replace(f"name: {machine}\n", f"name: {stem}\n", 1)
    spec = f"./{stem}.py:{camel(stem)}"
    if kind == "law":
        gains = "".join(f"    {gain}\n" for gain in PLANTS[machine].OWN.gains)
        return POSITION.sub(f"  position:\n    kind: {spec}\n{gains}", text)
    before, plant, _ = text.partition("\nplant:\n")  # the last section
    if kind == "plant":
        return f"{before}{plant}  kind: {spec}\n"
    entry = f"  physics:\n    - {{term: {spec}, node: {PLANTS[machine].OWN.node}, c: {PLANTS[machine].OWN.drag}}}\n"
    return before + plant + PHYSICS.sub("", text.removeprefix(before + plant)) + entry
