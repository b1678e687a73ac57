"""Layers of the packages: a package imports only from lower layers (docs/architecture.md)."""

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
FLOORS = (
    "cli", "scope", "terminal", "foxglove", "watch", "machine_report", "reproduce", "improve", "identify", "design",
    "trend", "diagnose", "daemon", "trace", "case", "loop", "machines", "own", "laws", "tick", "plants", "drivers",
    "config",
)  # fmt: skip


def imported(tree: ast.AST) -> Iterator[str]:
    """Modules of this program that a module imports, anywhere in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def floor_of(parts: tuple[str, ...]) -> str | None:
    """Package of a path or dotted name; None outside of the layers."""
    name = parts[1] if parts[0] == "rtctl" and len(parts) > 1 else parts[0]
    return name if name in FLOORS else None


def test_imports_point_down():
    found: dict[str, set[str]] = {}
    for folder in ("rtctl", "plants", "drivers"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            own = floor_of(path.relative_to(ROOT).parts)
            if own is None:
                continue
            for module in imported(ast.parse(path.read_text("utf-8"))):
                other = floor_of(tuple(module.split("."))) if module.startswith("rtctl.") else None
                if other is not None and FLOORS.index(other) < FLOORS.index(own):
                    found.setdefault(path.relative_to(ROOT).as_posix(), set()).add(other)
    assert found == {}
