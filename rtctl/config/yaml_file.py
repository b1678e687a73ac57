"""YAML with line numbers."""

from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from rtctl.config.errors import UserError


class Document(NamedTuple):
    data: Any

    def line(self, path: tuple) -> int | None:
        return None


def find(path: str | Path) -> Path:
    p = Path(path)
    if p.exists():
        return p
    for name in (str(path), f"{path}.yaml"):
        packaged = Path(str(resources.files("rtctl.configs"))) / name
        if packaged.exists():
            return packaged
    raise UserError(f"{path}: no such file")


def load_yaml(path: str | Path) -> Document:
    return Document(yaml.safe_load(Path(path).read_text()))
