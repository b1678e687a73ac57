"""Loading a config: YAML, overrides, validation, each mistake in one line that says where and what would be right."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from pydantic import ValidationError

from rtctl.config.complaints import sentences
from rtctl.config.errors import UserError
from rtctl.config.fields import Shape, fill, put, unknown, written
from rtctl.config.yaml_file import Document, find, load_yaml, parse, scalar_tag
from rtctl.idiom import Settings


class Widen(NamedTuple):
    """Functions for a config that names files of the user; see rtctl.own.model."""

    long_form: Callable[[Any], Any]  # data with short forms -> data in the long form
    widened: Callable[[Any, Any, Path], tuple[Any, Any]]  # class, data, its folder -> class, and the data complete


def load_settings(
    path: str | Path, model: type[Settings], overrides: Sequence[str] = (), widen: Widen | None = None
) -> Any:
    """Settings of a file, with `key.path=value` overrides. Raises UserError with one line for each mistake.

    With `widen`, a config that names files of the user has another class than `model`.
    """
    file = find(path)
    document = load_yaml(file)
    data = {} if document.data is None else document.data  # an empty file lacks its keys, as {} does
    said: dict[tuple, str] = {}
    texts = dict(document.texts)
    if widen is not None:
        data = widen.long_form(data)
    for text in overrides:
        key, equals, value = text.partition("=")
        if not equals:
            raise UserError(f"--set {text}: write key=value, e.g. loop.rate=500")
        given = parse(value, f"--set {text}")
        made = put(data, Shape(model, model=model), key, given.data, f"--set {text}")
        said.update(dict.fromkeys(made, text))
        texts = {path: word for path, word in texts.items() if path[: len(made[-1])] != made[-1]}
        texts |= {(*made[-1], *path): word for path, word in given.texts.items()}
    if widen is not None:
        try:
            model, data = widen.widened(model, data, file.parent)
        except ValueError as error:
            at: tuple = getattr(error, "key", ())
            raise UserError(f"{_where(document, said, at)}: {'.'.join(map(str, at))}: {error}") from error
    data = fill(Shape(model, model=model), data)
    try:
        return model.model_validate(data, context={"folder": file.parent})
    except ValidationError as error:
        raise UserError(sentences(error, model, data, lambda at: _where(document, said, at), texts)) from error


def get_path(settings: Any, path: str) -> Any:
    """The setting at a dotted path such as law.position.gain or reference.steps.0.at. Raises UserError."""
    node = settings
    for i, part in enumerate(path.split(".")):
        here = ".".join(path.split(".")[:i])
        if isinstance(node, (list, tuple)):
            if not (part.isascii() and part.isdigit() and len(part) < 7 and int(part) < len(node)):
                raise UserError(f"{path}: '{part[:40]}' is not an index of {here}, which has {len(node)} items")
            node = node[int(part)]
        elif isinstance(node, dict):
            if part not in node:
                raise UserError(f"{path}: {here} has no '{part[:40]}'; {unknown(part, node)}")
            node = node[part]
        elif not hasattr(type(node), "model_fields"):
            raise UserError(f"{path}: {here} is a value and has no key '{part[:40]}'")
        elif part not in type(node).model_fields:
            raise UserError(f"{path}: unknown key '{part[:40]}'; {unknown(part, type(node).model_fields)}")
        else:
            node = getattr(node, part)
    return node


def set_path(settings: Any, path: str, value: Any) -> Any:
    """New settings with `value`, SI or text with a unit, at a dotted path. Raises UserError where it does not fit."""
    return set_paths(settings, {path: value})


def set_paths(settings: Any, values: Mapping[str, Any]) -> Any:
    """New settings with several values at dotted paths; only all of them together must be valid."""
    model = type(settings)
    data = written(settings)
    for path, value in values.items():
        put(data, Shape(model, model=model), path, value)
    data = fill(Shape(model, model=model), data)
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise UserError(sentences(error, model, data)) from error


def to_yaml(settings: Any, full: bool = False) -> str:
    """YAML that loads to equal settings, in SI: what was written, or with `full` every key."""
    data = settings.model_dump() if full else written(settings)
    return yaml.dump(data, Dumper=Dumper, sort_keys=False, allow_unicode=True, width=120)


def _where(document: Document, said: dict[tuple, str], path: tuple) -> str:
    """File and line of a path, or the override that made it."""
    for end in range(len(path), 0, -1):
        if path[:end] in said:
            return f"--set {said[path[:end]]}"
        if path[:end] in document.lines:
            return f"{document.path}:{document.lines[path[:end]]}"
    return document.path


class Dumper(yaml.SafeDumper):
    """YAML dumper that quotes text which YAML 1.1 or 1.2 would read as another type, and keeps line breaks."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.Node:
    style = "|" if "\n" in text else '"' if scalar_tag(text) != "str" else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


Dumper.add_representer(str, _text)
