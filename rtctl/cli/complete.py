"""Shell completion: configs, references, keys, faults, terms, and running machines."""

import contextlib
import json
import os
from collections.abc import Iterator
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from typing import Any

SOURCES = ("config", "machines", "laws", "loop", "drivers", "plants")  # packages that the words come from


def configs(incomplete: str) -> list[str]:
    """Shipped configs, and YAML files and folders by path."""
    return [*_shipped("", incomplete), *_files(incomplete)]


def references(incomplete: str) -> list[str]:
    """Shipped references, and YAML files and folders by path."""
    return [*_shipped("references", incomplete), *_files(incomplete)]


def campaigns(incomplete: str) -> list[str]:
    """Shipped campaigns, and YAML files and folders by path."""
    return [*_shipped("campaigns", incomplete), *_files(incomplete)]


def machines(incomplete: str) -> list[str]:
    """Machines that run on this computer."""
    from rtctl.cli.common import running

    return [name for name in running() if name.startswith(incomplete)]


def keys(incomplete: str) -> list[str]:
    """Config keys of all machines, without the keys of list items."""
    return _starting("keys", incomplete)


def faults(incomplete: str) -> list[str]:
    """Faults that can be injected."""
    return _starting("faults", incomplete)


def terms(incomplete: str) -> list[str]:
    """Terms of physics."""
    return _starting("terms", incomplete)


def _shipped(folder: str, incomplete: str) -> list[str]:
    place = Path(str(resources.files("rtctl.configs"))) / folder
    return sorted(path.stem for path in place.glob("*.yaml") if path.stem.startswith(incomplete))


def _files(incomplete: str) -> list[str]:
    """YAML files and folders whose path starts with `incomplete`."""
    head, _, start = incomplete.rpartition("/")
    folder = Path(head or ("/" if incomplete.startswith("/") else "."))
    found: list[str] = []
    with contextlib.suppress(OSError):
        for entry in sorted(os.scandir(folder), key=lambda e: e.name):
            if entry.name.startswith(start) and (start.startswith(".") or not entry.name.startswith(".")):
                path = f"{incomplete[: len(incomplete) - len(start)]}{entry.name}"
                found += [f"{path}/"] if entry.is_dir() else [path] * path.endswith((".yaml", ".yml"))
    return found


def _starting(kind: str, incomplete: str) -> list[str]:
    return [word for word in words()[kind] if word.startswith(incomplete)]


def words() -> dict[str, list[str]]:
    """Keys, faults and terms, cached in a file because importing the settings takes half a second."""
    from rtctl import __version__
    from rtctl.config.cache import cache_folder
    from rtctl.config.errors import UserError
    from rtctl.config.files import write_text
    from rtctl.config.private import made

    try:
        file = cache_folder() / f"completion-{__version__}.json"
    except UserError:  # no error while the shell completes; the next command reports it
        return _collect()
    with contextlib.suppress(OSError, ValueError):
        if file.stat().st_mtime > max(_written()):
            return dict(json.loads(file.read_text()))
    found = _collect()
    with contextlib.suppress(OSError, UserError):
        write_text(made(file.parent) / file.name, json.dumps(found))
    return found


def _written() -> Iterator[float]:
    """Modification times of the source files that the words come from, in s."""
    for package in SOURCES:
        found = find_spec(f"rtctl.{package}")  # without importing it
        for folder in (found.submodule_search_locations or []) if found else []:
            for path in Path(folder).rglob("*.py"):
                yield path.stat().st_mtime


def _collect() -> dict[str, Any]:
    from rtctl.config.schema import settings_table
    from rtctl.machines import EVERY
    from rtctl.plants.physics import TERMS
    from rtctl.tick.faults import KINDS

    rows = [row for model in EVERY.values() for row in settings_table(model) if row.type != "keys"]
    paths = {_plain(row.path) for row in rows if "[]" not in row.path}
    return {"keys": sorted(paths), "faults": list(KINDS), "terms": list(TERMS)}


def _plain(path: str) -> str:
    """Key as written in a config: law.position[pd].gain becomes law.position.gain."""
    while "[" in path:
        head, _, tail = path.partition("[")
        path = head + tail.partition("]")[2]
    return path
