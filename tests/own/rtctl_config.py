"""Loads configs as the command line does."""

from pathlib import Path
from typing import Any

from rtctl.cli import common

TEMPLATES = Path(__file__).parents[2] / "rtctl" / "own" / "templates"


def loaded(file: Path, *changes: str) -> Any:
    """Settings of a file, with changes as after --set."""
    return common.load_config(str(file), list(changes))
