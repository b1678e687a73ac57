"""Reader of a case of a described machine: exchange format 2, checked.

Source: docs/bring_your_own_machine.md.
"""

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rtctl.case.checks import FROM_ELSEWHERE, delay_samples, sample_rate, strange
from rtctl.case.controller import controller
from rtctl.case.graph_case import PROBLEMS, GraphCase
from rtctl.case.known import inputs, numbers, physics
from rtctl.case.laws import NoLaw, UnknownLaw
from rtctl.case.paths import per_recording, tolerances
from rtctl.case.start import first_states, zeros
from rtctl.config.complaints import sentences
from rtctl.config.errors import UserError
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.layout import layout

KEYS = (
    "format", "sample_rate", "machine", "delay_samples", "tolerance", "physics", "inputs", "problem", "group",
    "per_recording", "controller", "loop", "controller_known", "notes",
)  # fmt: skip


def read_case(case: dict[str, Any], folder: Path | str) -> GraphCase:
    """Checked case of the bundle in `folder`. Raises UserError that names the key and what would be right."""
    where = Path(folder) / "case.json"
    given = case.get("machine")
    if not isinstance(given, dict):
        raise UserError(f"{where}: machine is {type(given).__name__}; it should be an object with bodies and sensors")
    warnings = [strange(where, key, "", KEYS) for key in case if key not in KEYS and key not in FROM_ELSEWHERE]
    try:
        machine = Description.model_validate(given)
    except ValidationError as error:
        raise UserError(sentences(error, Description, given, lambda _: f"{where}: machine").splitlines()[0]) from None
    placed = layout(machine)
    values = dict(machine.paths())
    values |= dict.fromkeys(zeros(machine, placed, values), 1.0)
    terms = physics(where, placed, case.get("physics"))
    values |= numbers(terms)
    problem = case.get("problem", "driven")
    if problem not in PROBLEMS:
        raise UserError(f"{where}: problem is {problem!r}; it should be one of {', '.join(PROBLEMS)}")
    values |= dict.fromkeys(first_states(machine, placed, problem), 1.0)
    shares, default = tolerances(where, case.get("tolerance"), values, warnings)
    differ = per_recording(where, case.get("per_recording"), values)
    rate, delay = sample_rate(where, case), delay_samples(where, case)
    if delay is None:
        delay = 0.0
        if machine.drives and problem == "driven":
            warnings.append(f"{where}: delay_samples is missing; 0 is taken")
    law = controller(where, case, machine, problem, warnings)
    return GraphCase(
        machine=machine,
        layout=placed,
        values=values,
        tolerances=shares,
        default_tolerance=default,
        physics=terms,
        inputs=inputs(where, machine, case.get("inputs")),
        problem=problem,
        delay_samples=delay,
        sample_rate=rate,
        group=str(case.get("group") or ""),
        per_recording=differ,
        notes=str(case.get("notes") or ""),
        warnings=tuple(warnings),
        file=where,
        config=_own_config(case),
        open_loop=isinstance(law, NoLaw),
        controller=None if isinstance(law, NoLaw | UnknownLaw) else law,
    )


def _own_config(case: dict[str, Any]) -> dict[str, Any] | None:
    config = case.get("config")
    return config if isinstance(config, dict) and isinstance(config.get("machine"), dict) else None
