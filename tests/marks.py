"""Marks of long tests. CI runs those with the mark `long`; RTCTL_PROOF=full runs those with the mark `full` as well."""

import os
from collections.abc import Callable, Iterable
from typing import Any

import pytest

FULL = os.environ.get("RTCTL_PROOF") == "full"
full = pytest.mark.skipif(not FULL, reason="takes a minute of computing; RTCTL_PROOF=full runs it")


def long_where(is_long: Callable[[Any], bool], values: Iterable[Any]) -> list[Any]:
    """Parameters of a test, with the mark `long` where `is_long(value)`; a tuple holds several arguments."""
    return [
        pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=pytest.mark.long)
        if is_long(value) else value
        for value in values
    ]  # fmt: skip
