"""Settings classes in other units: from quantities per rad or per m of a position to those of any machine.

A law is written once, with its gain in V/rad or V/m. Where a loop closes on a speed in rad/s and commands a torque in
Nm, the gain is in Nm*s/rad.
"""

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BeforeValidator, create_model
from pydantic.fields import FieldInfo

from rtctl.config.units import to_si

FACTOR = re.compile(r"([*/]?)\s*([^\W\d]+)(?:\^(-?\d+))?")
Powers = dict[str, int]


def powers(unit: str) -> Powers:
    """Powers of the symbols in a unit such as V*s^2/rad; none for a bare number."""
    found: Powers = {}
    for sign, symbol, power in FACTOR.findall(unit.replace("1/", "/").replace("%", "percent")):
        found[symbol] = found.get(symbol, 0) + (-1 if sign == "/" else 1) * int(power or 1)
    return found


def text(unit: Powers) -> str:
    """Text of a unit from its powers: V*s^2/rad."""
    over = "*".join(_power(s, n) for s, n in unit.items() if n > 0)
    under = "".join(f"/{_power(s, -n)}" for s, n in unit.items() if n < 0)
    return (over or ("1" if under else "")) + under


def changed(unit: str, symbols: Mapping[str, str]) -> str:
    """A unit with some of its symbols replaced by other units."""
    found: Powers = {}
    for symbol, power in powers(unit).items():
        for inner, n in powers(symbols.get(symbol, symbol)).items():
            found[inner] = found.get(inner, 0) + n * power
    return text(found)


def _power(symbol: str, power: int) -> str:
    return symbol if power == 1 else f"{symbol}^{power}"


def with_units(model: Any, symbols: Mapping[str, str]) -> Any:
    """Settings class with `symbols` of its units replaced, also in nested settings. Cached."""
    return _made(model, tuple(sorted(symbols.items())))


@lru_cache(maxsize=256)
def _made(model: Any, symbols: tuple[tuple[str, str], ...]) -> Any:
    fields: dict[str, Any] = {}
    for name, field in model.model_fields.items():
        annotation = _annotation(field.annotation, symbols)
        new = _field(field, symbols)
        default = field.default
        if hasattr(type(default), "model_fields") and annotation is not field.annotation:
            default = _moved(default, symbols)
            new = _copied(new, default=default)
        if annotation is not field.annotation or new is not field:
            fields[name] = (annotation, new)
    if not fields:
        return model
    return create_model(model.__name__, __base__=model, __doc__=model.__doc__, __module__=model.__module__, **fields)


def _moved(settings: Any, symbols: tuple[tuple[str, str], ...]) -> Any:
    """Settings with unchanged numbers, of the class with other units."""
    given = {name: getattr(settings, name) for name in settings.model_fields_set}
    kind: Any = type(settings)
    return _made(kind, symbols).model_validate(given)


def _annotation(annotation: Any, symbols: tuple[tuple[str, str], ...]) -> Any:
    """Annotation with every settings class in other units; the same object where it has none."""
    if hasattr(annotation, "model_fields"):
        return _made(annotation, symbols)
    inner = get_args(annotation)
    if get_origin(annotation) is Annotated:
        made = _annotation(inner[0], symbols)
        return annotation if made is inner[0] else Annotated[made, *inner[1:]]
    parts = tuple(_annotation(part, symbols) for part in inner)
    if all(a is b for a, b in zip(parts, inner, strict=True)):
        return annotation
    if get_origin(annotation) is list:
        return list[parts[0]]  # type: ignore[valid-type]
    return Union[parts]  # noqa: UP007  classes are made at run time


def _field(field: FieldInfo, symbols: tuple[tuple[str, str], ...]) -> FieldInfo:
    extra = field.json_schema_extra
    unit = extra.get("unit") if isinstance(extra, dict) else None
    if not isinstance(unit, str) or not unit:
        return field
    other = changed(unit, dict(symbols))
    if powers(other) == powers(unit):
        return field
    made = _copied(field)
    made.json_schema_extra = {**extra, "unit": other}  # type: ignore[dict-item]
    converters = [item for item in made.metadata if isinstance(item, BeforeValidator)]
    kept = [item for item in made.metadata if item not in converters[-1:]]
    made.metadata = [*kept, BeforeValidator(lambda value: to_si(value, other))]
    return made


def _copied(field: FieldInfo, **changes: Any) -> FieldInfo:
    import copy

    made = copy.copy(field)
    made.metadata = list(field.metadata)
    for name, value in changes.items():
        setattr(made, name, value)
    return made
