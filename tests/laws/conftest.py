import cmath
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rtctl.idiom import fill_record, record_dtype


@pytest.fixture(scope="session")
def zero() -> Callable[[np.dtype], Any]:
    """An all-zero state record."""
    return lambda dtype: np.zeros(1, dtype).view(np.recarray)[0]


@pytest.fixture(scope="session")
def record() -> Callable[[Any], Any]:
    """Parameters as the running tick reads them: a structured record."""

    def make(params: Any) -> Any:
        rows = np.zeros(1, record_dtype(params))
        fill_record(rows[0], params)
        return rows[0]

    return make


@pytest.fixture(scope="session")
def response() -> Callable[[Any, float, float], complex]:
    """Frequency response of a biquad at `f` Hz, from its coefficients."""

    def at(p: Any, f: float, dt: float) -> complex:
        z = cmath.exp(-2j * np.pi * f * dt)
        return (p.b0 + p.b1 * z + p.b2 * z * z) / (1 + p.a1 * z + p.a2 * z * z)

    return at
