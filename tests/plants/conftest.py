"""What tests of the plants share."""

from collections.abc import Callable
from typing import Any

import pytest
from numba.core.runtime import _nrt_python, rtsys  # type: ignore[attr-defined]


@pytest.fixture
def allocations() -> Callable[..., int]:
    """How many blocks of memory a call of a compiled function takes, by numba's own counter."""

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
