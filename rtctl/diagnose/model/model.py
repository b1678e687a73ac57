"""Model of a described machine: numbers by dotted path, and terms of physics on top of its equations."""

from typing import Any, NamedTuple

import numpy as np

from rtctl.case.graph_case import GraphCase
from rtctl.idiom import Settings
from rtctl.plants.graph.coupled import machine_params
from rtctl.plants.graph.joints import sprung
from rtctl.plants.graph.layout import Layout, layout
from rtctl.plants.graph.params import GraphParams
from rtctl.plants.physics import TERMS

PHYSICS = "physics."  # head of the paths of the nominal terms
RECORDING = "@"  # separator between the path of a number and the name of its recording


class GraphModel(NamedTuple):
    """Numbers (SI) and the terms of the `physics:` list."""

    layout: Layout
    base: dict[str, float]
    terms: tuple[Settings, ...] = ()

    def known(self) -> int:
        """Number of the nominal terms, which come first."""
        return len({path.split(".")[1] for path in self.base if path.startswith(PHYSICS)})

    def without_known(self, index: int) -> "GraphModel":
        """Model without one of the nominal terms."""
        base: dict[str, float] = {}
        for path, value in self.base.items():
            head, *rest = path.split(".", 2)
            if path.startswith(PHYSICS):
                number = int(rest[0])
                if number == index:
                    continue
                path = ".".join([head, str(number - (number > index)), *rest[1:]])
            base[path] = value
        return self._replace(base=base, terms=(*self.terms[:index], *self.terms[index + 1 :]))

    def resolved(self) -> "GraphModel":
        """Model whose nominal terms have the numbers of `base`."""
        found: dict[int, dict[str, float]] = {}
        for path, value in self.base.items():
            if path.startswith(PHYSICS) and RECORDING not in path:
                _, number, key = path.split(".")
                found.setdefault(int(number), {})[key] = value
        terms = [t.model_copy(update=found[i]) if i in found else t for i, t in enumerate(self.terms)]
        return self._replace(terms=tuple(terms))

    def add(self, *terms: Settings) -> "GraphModel":
        """Model with more terms."""
        return self._replace(terms=(*self.terms, *terms))

    def tied(self, path: str) -> tuple[str, ...]:
        """Paths of the numbers that share the symbol of a path, and change together."""
        for paths in self.layout.machine.symbols.values():
            if path in paths:
                return tuple(paths)
        return (path,)

    def built(self) -> "GraphModel":
        """Model in which joints with a compliance term are springs of the description."""
        machine, numbers = sprung(self.layout.machine, self.terms)
        if not numbers:
            return self
        same = {name: joint.model_copy(update={"stiffness": 1.0, "damping": 1.0})
                for name, joint in machine.joints.items() if f"joints.{name}.stiffness" in numbers}  # fmt: skip
        known = machine.model_copy(update={"joints": {**machine.joints, **same}})  # one layout for all their numbers
        return self._replace(layout=layout(known), base={**self.base, **numbers})

    def params(self, h: float) -> GraphParams:
        """Params of the plant for substeps of `h` s."""
        return machine_params(self.layout, self.base, h)


def nominal(case: GraphCase) -> GraphModel:
    """Nominal model: the description and the nominal terms."""
    return GraphModel(case.layout, dict(case.values), tuple(settings_of(entry) for entry in case.physics))


def own(values: dict[str, float], name: str) -> dict[str, float]:
    """Numbers of one recording: its own numbers replace the shared ones."""
    if not any(RECORDING in path for path in values):
        return values
    out = {path: value for path, value in values.items() if RECORDING not in path}
    out |= {path.partition(RECORDING)[0]: value for path, value in values.items() if path.endswith(RECORDING + name)}
    return out


def settings_of(entry: dict[str, Any]) -> Settings:
    """Settings of an entry of a `physics:` list."""
    return TERMS[str(entry["term"])].settings.model_validate(entry)


def rigid(layout: Layout, values: dict[str, float], main: str) -> dict[str, float]:
    """Motion of each body for one unit of the body `main`, joints taken as rigid; 0 where no joint connects the two."""
    machine = layout.machine
    out = {main: 1.0}
    todo = [main]
    while todo:
        here = todo.pop()
        for name, joint in machine.joints.items():
            a, b, n = getattr(joint, "from"), joint.to, ratio_of(joint, name, values)
            for one, other, ratio in ((a, b, n), (b, a, 1.0 / n)):
                if one == here and other not in out and not machine.is_frame(other):
                    out[other] = out[here] * ratio
                    todo.append(other)
    return {name: out.get(name, 0.0) for name in machine.bodies if not machine.is_frame(name)}


def carried(layout: Layout, values: dict[str, float], ratios: dict[str, float]) -> dict[int, float]:
    """Motion of each moving coordinate, rad or m, for a motion of the bodies by `ratios`."""
    moving = {name: ratio for name, ratio in ratios.items() if ratio != 0.0}
    return {layout.coordinate(name): ratio / layout.ratio(name, values) for name, ratio in moving.items()}


def moved_inertia(inertia: np.ndarray, moved: dict[int, float]) -> float:
    """Reflected inertia, kg or kg m^2, at the body for whose unit motion the coordinates move by `moved`; `inertia` is
    that of each coordinate."""
    return float(sum(ratio**2 * inertia[at] for at, ratio in moved.items()))


def ratio_of(joint: Any, name: str, values: dict[str, float]) -> float:
    """Transmission ratio of a joint: motion of its far end for one unit of its near end; of a span by the radii."""
    if joint.span is None:
        return values[f"joints.{name}.ratio"]
    near, far = (values[f"bodies.{body}.radius"] for body in (getattr(joint, "from"), joint.to))
    return near / far if joint.span == "open" else -near / far
