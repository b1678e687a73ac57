"""Decorator of the compiled functions of this folder, keyed by all sources of the true machine."""

from pathlib import Path

from rtctl.proof.compiled import compiler

HERE = Path(__file__).parent
SOURCES = ("arrays", "friction", "forces", "command", "reading", "law", "memory", "solver")
compiled = compiler([*(HERE / f"{name}.py" for name in SOURCES), HERE.parent / "solver.py"])
