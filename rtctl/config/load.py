"""Loading a config: YAML, overrides, validation, each mistake in one line that says where and what would be right."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from rtctl.config.errors import UserError
from rtctl.idiom import Settings


def load_settings(path: str | Path, model: type[Settings], overrides: Sequence[str] = ()) -> Any:
    try:
        data = yaml.safe_load(Path(path).read_text())
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}") from error
    for item in overrides:
        key, _, value = item.partition("=")
        node = data
        parts = key.split(".")
        for part in parts[:-1]:
            node = node[int(part)] if isinstance(node, list) else node.setdefault(part, {})
        node[parts[-1]] = yaml.safe_load(value)
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise UserError(str(error)) from error


def get_path(settings: Any, path: str) -> Any:
    for part in path.split("."):
        settings = settings[int(part)] if isinstance(settings, (list, tuple)) else getattr(settings, part)
    return settings


def set_path(settings: Any, path: str, value: Any) -> Any:
    data = settings.model_dump(exclude_unset=True)
    node = data
    parts = path.split(".")
    for part in parts[:-1]:
        node = node[int(part)] if isinstance(node, list) else node.setdefault(part, {})
    node[parts[-1]] = value
    return type(settings).model_validate(data)
