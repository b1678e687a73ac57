"""Shared fixtures of the plant tests."""

from collections.abc import Callable
from typing import Any

import pytest
from numba.core.runtime import _nrt_python, rtsys  # type: ignore[attr-defined]


@pytest.fixture
def allocations() -> Callable[..., int]:
    """Function (compiled function, arguments) -> number of memory blocks that a call allocates, counted by numba."""

    def count(function: Any, *arguments: Any) -> int:
        function(*arguments)
        _nrt_python.memsys_enable_stats()
        try:
            before = rtsys.get_allocation_stats().alloc
            function(*arguments)
            return int(rtsys.get_allocation_stats().alloc - before)
        finally:
            _nrt_python.memsys_disable_stats()

    return count
