"""Case of either exchange format."""

from pathlib import Path
from typing import Any

from rtctl.case import format1, format2
from rtctl.case.format1 import Case
from rtctl.case.graph_case import GraphCase


def read_case(case: dict[str, Any], folder: Path | str) -> Case | GraphCase:
    """Checked case of the bundle in `folder`: of format 1 where it names a plant, else of format 2.

    Raises UserError that names the key and what would be right."""
    return format1.read_case(case, folder) if case.get("plant") is not None else format2.read_case(case, folder)
