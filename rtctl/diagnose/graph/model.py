"""Model of a described machine: numbers by dotted path, and terms of physics on top of its equations."""

from typing import Any, NamedTuple

from rtctl.diagnose.graph.case import GraphCase
from rtctl.idiom import Settings
from rtctl.plants.graph.layout import Layout, layout
from rtctl.plants.graph.params import GraphParams, build
from rtctl.plants.physics import TERMS


class GraphModel(NamedTuple):
    """Numbers (SI) and the terms of the `physics:` list."""

    layout: Layout
    base: dict[str, float]
    terms: tuple[Settings, ...] = ()

    def add(self, *terms: Settings) -> "GraphModel":
        """The same with more terms."""
        return self._replace(terms=(*self.terms, *terms))

    def tied(self, path: str) -> tuple[str, ...]:
        """Paths of the numbers that move with that of a path: those of the same symbol."""
        for paths in self.layout.machine.symbols.values():
            if path in paths:
                return tuple(paths)
        return (path,)

    def built(self) -> "GraphModel":
        """The same with the joints that its terms make springs as springs of the description."""
        base, machine = dict(self.base), self.layout.machine
        found: dict[str, Any] = {}
        for settings in self.terms:
            s: Any = settings
            made = TERMS[s.term].joint
            if made is not None and s.node in machine.joints:
                numbers = made(s)
                base |= {f"joints.{s.node}.{key}": value for key, value in numbers.items()}
                found[s.node] = machine.joints[s.node].model_copy(update=dict.fromkeys(numbers, 1.0))
        if not found:
            return self
        elastic = machine.model_copy(update={"joints": {**machine.joints, **found}})
        return self._replace(layout=layout(elastic), base=base)

    def params(self, h: float) -> GraphParams:
        """Params of the plant for substeps of `h` s."""
        return build(self.layout, self.base, h)


def nominal(case: GraphCase) -> GraphModel:
    """The owner's model: the description and the terms that the owner knows."""
    return GraphModel(case.layout, dict(case.values), tuple(settings_of(entry) for entry in case.physics))


def settings_of(entry: dict[str, Any]) -> Settings:
    """Settings of an entry of a `physics:` list."""
    return TERMS[str(entry["term"])].settings.model_validate(entry)


def rigid(layout: Layout, values: dict[str, float], main: str) -> dict[str, float]:
    """Motion of each body for one unit of the body `main`, joints taken as rigid; 0 where nothing connects the two."""
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


def ratio_of(joint: Any, name: str, values: dict[str, float]) -> float:
    """What the far end of a joint moves for one unit of its near end when it is not stretched; a span by the radii."""
    if joint.span is None:
        return values[f"joints.{name}.ratio"]
    near, far = (values[f"bodies.{body}.radius"] for body in (getattr(joint, "from"), joint.to))
    return near / far if joint.span == "open" else -near / far
