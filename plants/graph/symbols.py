"""Symbols of the literature: the numbers of a description by the names that a thesis or data sheet gives them.

A description maps each symbol to its numbers (`k_c: [joints.capstan.stiffness, joints.encoder.stiffness]`), so that a
parameter set in symbols fills a described machine.
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

from rtctl.config.yaml_file import load_yaml
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.layout import Layout, layout
from rtctl.plants.graph.params import GraphParams, build


class Machine(NamedTuple):
    """A description that comes with the program."""

    layout: Layout
    values: dict[str, float]  # by dotted path, SI

    def build(self, symbols: Mapping[str, float], others: Mapping[str, float], h: float) -> GraphParams:
        """Params for substeps of `h` s: `symbols` by symbol, `others` by dotted path; what neither has is as described.

        Raises KeyError for a symbol of the description that `symbols` lacks.
        """
        values = {**self.values, **others}
        for symbol, paths in self.layout.machine.symbols.items():
            value = symbols[symbol]
            for path in paths:
                values[path] = value
        return build(self.layout, values, h)


@cache
def machine(file: Path) -> Machine:
    """The machine that a YAML file describes. Raises UserError or ValidationError where the file is not valid."""
    described = Description.model_validate(load_yaml(file).data["machine"])
    return Machine(layout(described), dict(described.paths()))
