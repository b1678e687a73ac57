"""What a settings model says about a key path: its type, its field, the branches of a union, its children."""

import types
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo


class Slot(NamedTuple):
    """A place in the tree. `type` is without Annotated and Optional, `tag` is the key that chooses a branch."""

    type: Any
    tag: str | None = None
    optional: bool = False
    field: FieldInfo | None = None  # that declares it; for an item, the field of the list

    @property
    def is_model(self) -> bool:
        return isinstance(self.type, type) and issubclass(self.type, BaseModel)

    @property
    def unit(self) -> str | None:
        """Unit of a quantity ("" for a plain number), None for what is not a quantity."""
        extra = self.field.json_schema_extra if self.field else None
        return str(extra["unit"]) if isinstance(extra, dict) and "unit" in extra else None

    @property
    def help(self) -> str:
        return (self.field.description if self.field else None) or ""

    @property
    def choices(self) -> tuple[Any, ...]:
        """Values of a Literal."""
        return get_args(self.type) if get_origin(self.type) is Literal else ()

    def branches(self) -> dict[str, "Slot"]:
        """Models of a union with a tag, by the value of that tag."""
        found: dict[str, Slot] = {}
        if self.tag is not None and is_union(self.type):
            for option in get_args(self.type):
                inner = slot(option, self.field)
                if inner.is_model:
                    field = inner.type.model_fields.get(self.tag)
                    found |= dict.fromkeys(slot(field.annotation).choices if field else (), inner)
                else:
                    found |= inner._replace(tag=inner.tag or self.tag).branches()
        return found

    def branch(self, value: Any) -> "Slot":
        """The branch of a union that the data `value` (a dict or a model) asks for; the slot itself if there is none."""
        tag = value.get(self.tag) if isinstance(value, dict) else getattr(value, self.tag or "", None)
        return self.branches().get(tag, self) if isinstance(tag, str) else self

    def children(self) -> dict[str, "Slot"]:
        """Keys of a model."""
        if not self.is_model:
            return {}
        return {name: slot(field.annotation, field) for name, field in self.type.model_fields.items()}

    def item(self, index: int = 0) -> "Slot | None":
        """Slot of a list's or tuple's item, or of a dict's values."""
        origin, args = get_origin(self.type), get_args(self.type)
        if origin is tuple and args and args[-1] is not Ellipsis:
            return slot(args[index], self.field) if index < len(args) else None
        if origin in (list, tuple, set, frozenset) and args:
            return slot(args[0], self.field)
        return slot(args[1], self.field) if origin is dict and len(args) == 2 else None


def is_union(annotation: Any) -> bool:
    return get_origin(annotation) in (Union, types.UnionType)


def slot(annotation: Any, field: FieldInfo | None = None) -> Slot:
    """The slot for an annotation as written in a model."""
    tag = field.discriminator if field is not None and isinstance(field.discriminator, str) else None
    optional = False
    while True:
        if get_origin(annotation) is Annotated:
            for info in annotation.__metadata__:
                if isinstance(info, FieldInfo) and isinstance(info.discriminator, str):
                    tag = info.discriminator
            annotation = get_args(annotation)[0]
        elif is_union(annotation) and type(None) in get_args(annotation):
            optional = True
            rest = [option for option in get_args(annotation) if option is not type(None)]
            annotation = rest[0] if len(rest) == 1 else Union[tuple(rest)]  # noqa: UP007
        else:
            return Slot(annotation, tag, optional, field)


def locate(root: Slot, location: tuple[str | int, ...]) -> tuple[tuple[str | int, ...], Slot | None]:
    """Key path and slot of an error's location, which has names of union branches among the keys."""
    path: tuple[str | int, ...] = ()
    here: Slot | None = root
    for part in location:
        if here is None:
            path = (*path, part)
        elif is_union(here.type):
            branches = here.branches()
            if isinstance(part, str) and part in branches:
                here = branches[part]
            else:  # pydantic labels a branch of a union without a tag by its type
                options = [slot(option, here.field) for option in get_args(here.type)]
                here = next((o for o in options if getattr(o.type, "__name__", None) == part), here._replace(type=Any))
        elif here.is_model:
            path, here = (*path, part), here.children().get(str(part))
        elif part == "[key]":
            continue
        elif get_origin(here.type) in (list, tuple, dict, set, frozenset):
            path, here = (*path, part), here.item(part if isinstance(part, int) else 0)
        # anything else is pydantic's name for a validator or a type, not a key
    return path, here
