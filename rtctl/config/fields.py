"""Shape of a settings class at a path: nested settings, a choice among several, a list, or a value with its unit."""

from types import UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from rtctl.config.errors import UserError, nearest

DEEPEST = 30  # keys in a dotted path


class Shape(NamedTuple):
    """One place in a config. At most one of `model`, `choices`, `item` and `each` is set; a plain value has none."""

    annotation: Any
    field: FieldInfo | None = None
    model: Any = None  # settings class
    tag: str = ""  # key that chooses among `choices`
    choices: dict[str, Any] = {}  # noqa: RUF012  word -> settings class; never written to
    item: Any = None  # annotation of a list's items
    each: Any = None  # annotation of the values under names that the user chooses
    optional: bool = False

    @property
    def unit(self) -> str | None:
        """Unit of a quantity; None for any other value."""
        extra = self.field.json_schema_extra if self.field else None
        unit = extra.get("unit") if isinstance(extra, dict) else None
        return unit if isinstance(unit, str) else None


def shape(annotation: Any, field: FieldInfo | None = None) -> Shape:
    """Shape of an annotation; `field` has the unit, the help and the key that chooses."""
    if get_origin(annotation) is Annotated:
        inner, *extras = get_args(annotation)
        return shape(inner, next((extra for extra in extras if isinstance(extra, FieldInfo)), field))
    if get_origin(annotation) in (Union, UnionType):
        members = [member for member in get_args(annotation) if member is not type(None)]
        optional = len(members) < len(get_args(annotation))
        if field is not None and isinstance(field.discriminator, str):
            tag = field.discriminator
            return Shape(annotation, field, tag=tag, choices=_choices(members, tag), optional=optional)
        return shape(members[0], field)._replace(optional=optional) if len(members) == 1 else Shape(annotation, field)
    if hasattr(annotation, "model_fields"):
        return Shape(annotation, field, annotation)
    if get_origin(annotation) in (list, tuple):
        return Shape(annotation, field, item=get_args(annotation)[0])
    if get_origin(annotation) is dict:
        return Shape(annotation, field, each=get_args(annotation)[1])
    return Shape(annotation, field)


def child(place: Shape, part: Any) -> Shape | None:
    """Shape one key or index below `place`; None where there is none."""
    if place.model is not None and part in place.model.model_fields:
        field = place.model.model_fields[part]
        return shape(field.annotation, field)
    if place.item is not None and isinstance(part, int):
        return shape(place.item)
    return shape(place.each) if place.each is not None else None


def literals(annotation: Any) -> list[Any]:
    """Words that a Literal allows; empty for any other annotation."""
    return list(get_args(annotation)) if get_origin(annotation) is Literal else []


def fill(place: Shape, data: Any) -> Any:
    """Data completed from the default of a group: `limit: {slew: 5}` keeps the `high` of `limit = Limit(high=3)`."""
    if isinstance(data, list) and place.item is not None:
        return [fill(shape(place.item), item) for item in data]
    if not isinstance(data, dict):
        return data
    if place.each is not None:
        return {name: fill(shape(place.each), value) for name, value in data.items()}
    model = place.model or _chosen(place, data)
    if model is None:
        return data
    default = place.field.default if place.field is not None else None
    result = {**written(default), **data} if type(default) is model else dict(data)
    for name, value in result.items():
        inner = child(Shape(model, model=model), name)
        result[name] = fill(inner, value) if inner is not None and name in data else value
    return result


def written(value: Any) -> Any:
    """Plain data of settings: the written keys, without added defaults, and always the key that chooses."""
    if hasattr(type(value), "model_fields"):
        fields = type(value).model_fields
        return {
            name: written(getattr(value, name))
            for name, field in fields.items()
            if name in value.model_fields_set or len(literals(field.annotation)) == 1
        }
    if isinstance(value, dict):
        return {name: written(item) for name, item in value.items()}
    return [written(item) for item in value] if isinstance(value, (list, tuple)) else value


def put(data: Any, place: Shape, path: str, value: Any, said: str = "") -> list[tuple]:
    """Set `value` in plain `data` at a dotted path. Returns the new paths; raises UserError with `said` in front.

    A list takes an index, or the index after its last. Missing keys on the way start from their defaults.
    """
    said = said or path
    node, at, made = data, place, []
    parts = [part.strip() for part in path.split(".")]
    if len(parts) > DEEPEST:
        raise UserError(f"{said[:80]}: no key is that deep")
    walked: tuple = ()
    for i, part in enumerate(parts):
        key: Any = part
        here = ".".join(parts[:i])
        if isinstance(node, list):
            if not part.isascii() or not part.isdigit() or len(part) > 6 or int(part) > len(node):
                raise UserError(f"{said}: '{part[:40]}' is not an index of {here}, which has {len(node)} items")
            key = int(part)
        elif not isinstance(node, dict):
            raise UserError(f"{said}: {here or 'the config'} is a value and has no key '{part[:40]}'")
        elif not part:
            raise UserError(f"{said}: a key is missing; write e.g. loop.rate=500")
        if at.choices:
            model = _chosen(at, node)
            at = Shape(model, model=model)
        at = child(at, key) or Shape(None)
        walked += (key,)
        if i == len(parts) - 1:
            fresh = value
        elif (key < len(node)) if isinstance(node, list) else (node.get(key) is not None):
            fresh = node[key]
        else:
            default = at.field.default if at.field is not None else None
            fresh = (
                written(default) if hasattr(type(default), "model_fields") or isinstance(default, (list, tuple)) else {}
            )
        if i == len(parts) - 1 or not (isinstance(node, dict) and node.get(key) is fresh):
            made.append(walked)
        if isinstance(node, list) and key == len(node):
            node.append(fresh)
        else:
            node[key] = fresh
        node = fresh
    return made


def unknown(name: str, known: Any) -> str:
    """End of a message about an unknown name: the nearest known name, else the known names (at most 30)."""
    words = [str(word) for word in known]
    near = nearest(name, words)
    if near is not None:
        return f"did you mean '{near}'?"
    return f"there is {', '.join(words[:30])}" if words else "there is none here"


def _choices(members: list[Any], tag: str) -> dict[str, Any]:
    return {str(word): member for member in members for word in literals(member.model_fields[tag].annotation)}


def _chosen(place: Shape, data: Any) -> Any:
    word = data.get(place.tag) if isinstance(data, dict) else None
    return place.choices.get(word) if isinstance(word, str) else None
