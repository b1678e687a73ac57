"""Check of a machine's user files, before its tick is compiled."""

from pathlib import Path
from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.idiom import record_dtype
from rtctl.own import check, law, mechanics, plant
from rtctl.own.check import Verdict
from rtctl.own.files import OwnError, load, split
from rtctl.own.files import Source as File
from rtctl.own.parts import Parts

SIZE = {"rad": 1.0, "m": 2e-3}  # amplitude of the check's motion, in the unit of the machine's position


def verdicts(machine: Any) -> list[Verdict]:
    """Verdicts on the user's law and plant of a machine. Raises UserError where a file must not go into the tick."""
    found = []
    parts = law.own_laws.get(type(machine.config.law.position))
    if parts is not None:
        signals = check.healthy(law.SIGNALS, machine.dt, SIZE[machine.unit])
        found.append(check.check(parts, _params(machine.diagram, "position"), signals, machine.dt))
    parts = plant.own_plants.get(type(machine.config.plant))
    if parts is not None:
        h = machine.plant_period / machine.substeps
        signals = check.healthy(plant.INPUT_WORDS, h, SIZE[machine.unit])
        found.append(check.check(parts, _params(machine.plant_diagram, "own"), signals, h))
    coupling = getattr(machine.config.machine, "mechanics", None)
    if coupling is not None:
        file, name = split(coupling.kind)
        try:
            mechanics.checked(machine.config.machine, File(file, name, machine.config.own[file]))
        except OwnError as error:
            raise UserError(str(error)) from error
    for settings in machine.config.plant.physics:
        file = settings.term.partition(":")[0]
        if file in machine.config.own:
            _check_term(machine, settings, File(*split(settings.term), machine.config.own[file]))
    return found


def require(machine: Any, path: Path) -> None:
    """Check the user's files before the module at `path` is compiled, once for each module. Raises UserError."""
    mark = path.with_suffix(".checked")
    if machine.config.own and not mark.exists():
        verdicts(machine)
        mark.touch()


def _params(diagram: Any, name: str) -> Any:
    return next(block.params for block in diagram.blocks if block.name == name)


def _check_term(machine: Any, settings: Any, file: File) -> None:
    """Compile the lines of a term on the record of its machine. Raises UserError where they allocate."""
    from rtctl.plants.physics import TERMS
    from rtctl.plants.physics.term import SITES

    term, kind = TERMS[settings.term], machine.kind
    spot, record, ratio = _where(machine.config, kind, settings)
    empty = np.dtype([("spare", np.float64)])
    parts = Parts(load(file), file.name, term.settings, term.state or empty, file)
    lines = []
    for site in SITES:
        act = term.act_at(site, kind)
        if act is not None:
            lines += act.format(
                p="p", s="s", m="m", i=spot.node, l=spot.link, c=spot.channel,
                k=getattr(spot, "other", -1), r=ratio,
            ).split("\n")  # fmt: skip
    params = record_dtype(term.build(settings, machine.plant_period / machine.substeps))
    belief = record_dtype(_params(machine.plant_diagram, "plant"))
    try:
        check.check_lines(parts, lines, {"p": params, "s": parts.state, "m": record["m"], "plant": belief})
    except OwnError as error:
        raise UserError(str(error)) from error


def _where(config: Any, kind: str, settings: Any) -> tuple[Any, np.dtype, str]:
    """Place of an entry of `physics:`, record of its plant, and text of the node's ratio."""
    if not isinstance(config.machine, str):
        from rtctl.machines.described_plant import graph_of
        from rtctl.plants.graph.elements import place_of
        from rtctl.plants.graph.plant import GRAPH_STATE

        layout, values, _ = graph_of(config.machine, 1e-3)
        return place_of(layout, values, settings), GRAPH_STATE, "1.0"
    from rtctl.plants.physics import place
    from rtctl.plants.physics.place import PLANTS

    spot = place(kind, settings.node)
    return spot, getattr(PLANTS[kind], f"{kind.upper()}_STATE"), f"plant.{spot.factor}" if spot.factor else "1.0"
