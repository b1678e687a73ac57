"""Shipped machines with mechanics from a file, with changes by a test."""

from pathlib import Path
from typing import Any

import numpy as np

from rtctl.own.mechanics import give_machine
from rtctl.plants.graph.coupled import machine_params
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.file import read_machine
from rtctl.plants.graph.layout import layout

FOLDER = Path(__file__).parents[1] / "configs" / "machines"
NAMES = ("furuta", "cart-pole")


def data_of(name: str) -> dict[str, Any]:
    """Plain data of a shipped machine, SI; its code is registered."""
    path = FOLDER / f"{name}.yaml"
    give_machine(path)
    return read_machine(path).machine.model_dump(mode="json", exclude_unset=True)


def free(name: str, angle: float) -> Description:
    """A shipped machine without friction and back-EMF whose second body starts at an angle, rad."""
    data = data_of(name)
    first, second = data["bodies"]
    for body in data["bodies"].values():
        body |= {"dry": 0.0, "viscous": 0.0}
    data["drives"] = {"motor": {"body": first, "column": "u"}}
    data["mechanics"]["at"] = {second: angle}
    return Description.model_validate(data)


def params(machine: Description, h: float) -> Any:
    """Params of a machine for substeps of `h` s."""
    return machine_params(layout(machine), dict(machine.paths()), h)


def functions(p: Any) -> Any:
    """M (n, n) and h (n,) of a mechanics file at q, v, interpreted."""
    code, c = type(p).code, p.coupled

    def of(q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        M, h = np.zeros((len(q), len(q))), np.zeros(len(q))
        code.module.M.interpret(c.p, c.J, q, M)
        code.module.h.interpret(c.p, c.J, q, v, h)
        return M, h

    return of
