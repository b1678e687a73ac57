"""Import plan of the user for a foreign recording: mapping and units of columns, and the nominal model.

plant: axis
rate: 1 kHz                       # where the file has no time
columns:
  u: vir                          # rtctl name: name in the file
  x: {column: qm, unit: mm}
parameters: {M: 95 kg}
case: {drive: {newton_per_volt: 35.15}}     # further keys of case.json
text: {decimal: ",", names_line: 3}          # of a file of text, where it is not seen from the file
"""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationError

from rtctl.config.complaints import sentences
from rtctl.config.errors import UserError
from rtctl.config.yaml_file import load_yaml, parse
from rtctl.idiom import Settings, quantity
from rtctl.trace.imports.text_form import TextPlan


class ColumnPlan(Settings):
    column: str = Field(default="", description="what the column is called in the file; as here if absent")
    unit: str | None = Field(default=None, description="its unit there; as the file says, else SI, if absent")


def _by_name(given: Any) -> Any:
    """`u: vir` is short for `u: {column: vir}`."""
    return {"column": given} if isinstance(given, str) else given


class Plan(Settings):
    plant: Literal["axis", "ivu", "ldu"] | None = Field(default=None, description="kind of machine")
    rate: float | None = quantity(None, unit="Hz", gt=0, help="rows a second; as the time column says if absent")
    uneven: bool = Field(default=False, description="the rows are at uneven times and stay so")
    columns: dict[str, Annotated[ColumnPlan, BeforeValidator(_by_name)]] = Field(
        default={}, description="our column: theirs"
    )
    parameters: dict[str, float | str] = Field(default={}, description="of the plant's model, SI or with a unit")
    case: dict[str, Any] = Field(default={}, description="further keys of case.json, such as drive and sensors")
    text: TextPlan = Field(default=TextPlan(), description="of a file of text: where what stands in it, and how")


def load_plan(path: Path | str) -> Plan:
    """Plan from a YAML file. Raises UserError with file and line."""
    document = load_yaml(path)
    data = {} if document.data is None else document.data

    def where(at: tuple) -> str:
        line = document.line(at)
        return f"{path}:{line}" if line else f"{path}"

    if isinstance(data, dict) and "columns" in data:
        _check_columns(data["columns"], where)
    try:
        return Plan.model_validate(data)
    except ValidationError as error:
        raise UserError(sentences(error, Plan, data, where, document.texts)) from None


def _check_columns(columns: Any, where: Callable[[tuple], str]) -> None:
    """Raise UserError for invalid `columns`; the general check knows only fixed keys, not names chosen by the user."""
    if not isinstance(columns, dict):
        raise UserError(f"{where(('columns',))}: columns: write one line for each, such as x: qm")
    for name, given in columns.items():
        _check_column(name, given, where(("columns", name)))


def _check_column(name: Any, given: Any, line: str) -> None:
    if not isinstance(given, str | dict):
        raise UserError(f"{line}: columns.{name}: {given!r} is no name; a name that is a number needs quotes")
    try:
        ColumnPlan.model_validate(_by_name(given))
    except ValidationError as error:
        raise UserError(sentences(error, ColumnPlan, given, lambda path: f"{line}: columns.{name}")) from None


def with_options(
    plan: Plan,
    plant: str | None,
    maps: Sequence[str],
    units: Sequence[str],
    rate: str | None,
    parameters: Sequence[str],
    case: Sequence[str],
    uneven: bool,
    text: Mapping[str, Any] = MappingProxyType({}),
) -> Plan:
    """Plan with the options of the command line, which take precedence. Raises UserError."""
    columns = dict(plan.columns)
    mapped: dict[str, str] = {}
    for option in maps:
        for pair in re.split(r",(?=[^,=]*=)", option):  # `u=Torque, Request` is one column
            name, theirs = _pair("--map", pair, "x=qm")
            if mapped.setdefault(name, theirs) != theirs:
                raise UserError(f"--map: {name} cannot be both {mapped[name]} and {theirs}; name one column for it")
            columns[name] = ColumnPlan(column=theirs, unit=columns[name].unit if name in columns else None)
    for option in units:
        name, unit = _pair("--unit", option, "x=mm")
        columns[name] = ColumnPlan(column=columns[name].column if name in columns else "", unit=unit)
    update: dict[str, Any] = {
        "columns": {name: given.model_dump() for name, given in columns.items()},
        "parameters": {**plan.parameters, **_values("--parameter", parameters, "M=95")},
        "case": _nested(plan.case, case),
        "uneven": plan.uneven or uneven,
        "text": {**plan.text.model_dump(exclude_unset=True), **{k: v for k, v in text.items() if v is not None}},
    }
    update |= {"plant": plant} if plant is not None else {}
    update |= {"rate": _number(rate)} if rate is not None else {}
    return plan_of({**plan.model_dump(), **update}, _option)


def plan_of(data: Mapping[str, Any], where: Callable[[tuple], str] | None = None) -> Plan:
    """Plan from plain data; `where` names a key in a message. Raises UserError."""
    try:
        return Plan.model_validate(data)
    except ValidationError as error:
        raise UserError(sentences(error, Plan, dict(data), where or (lambda at: ".".join(map(str, at))))) from None


def _option(at: tuple) -> str:
    """Command-line option for a key of the plan."""
    names = [str(part) for part in at if part != "text"]
    return f"--{names[0].replace('_', '-')}" if names else "import"


def _pair(option: str, text: str, example: str) -> tuple[str, str]:
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise UserError(f"{option} {text}: write ours=theirs, e.g. {example}")
    return name, value


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _values(option: str, texts: Sequence[str], example: str) -> dict[str, float | str]:
    return {name: _number(value) for name, value in (_pair(option, text, example) for text in texts)}


def _nested(case: dict[str, Any], texts: Sequence[str]) -> dict[str, Any]:
    """`drive.newton_per_volt=35` into {"drive": {"newton_per_volt": 35}}."""
    case = {key: dict(value) if isinstance(value, dict) else value for key, value in case.items()}
    for text in texts:
        path, value = _pair("--case", text, "drive.newton_per_volt=35.15")
        *outer, last = path.split(".")
        node = case
        for key in outer:
            node = node.setdefault(key, {})
            if not isinstance(node, dict):
                raise UserError(f"--case {text}: {key} is a value and has no key '{last}'")
        node[last] = parse(value, f"--case {text}").data
    return case
