"""The mark `long` for a part of the parameters of a test."""

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def long_where(is_long: Callable[[Any], bool], values: Iterable[Any]) -> list[Any]:
    """Parameters of a test, with the mark `long` where `is_long(value)`; a tuple holds several arguments."""
    return [
        pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=pytest.mark.long)
        if is_long(value) else value
        for value in values
    ]  # fmt: skip
