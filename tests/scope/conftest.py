"""Fixtures: rows of a synthetic machine, and a decoder of frames."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rtctl.idiom import state
from rtctl.scope.history import History

ROW = state(tick=int, t=float, u=float, v=float)
RATE = 1000.0


@pytest.fixture
def rows() -> Callable[..., np.ndarray]:
    """`rows(first, count, u=...)`: rows at 1 kHz; u is a function of t."""

    def make(first: int, count: int, u: Callable[[np.ndarray], Any] = np.sin) -> np.ndarray:
        made = np.zeros(count, ROW)
        made["tick"] = np.arange(first, first + count)
        made["t"] = made["tick"] / RATE
        made["u"] = u(made["t"])
        made["v"] = -made["tick"]
        return made

    return make


@pytest.fixture
def history() -> History:
    return History(ROW, 20_000)


@pytest.fixture
def unpack() -> Callable[[bytes], tuple[dict[str, Any], np.ndarray]]:
    """Decode a frame as the page does: header and arrays."""

    def read(frame: bytes) -> tuple[dict[str, Any], np.ndarray]:
        length = int.from_bytes(frame[:4], "little")
        about = json.loads(frame[4 : 4 + length])
        return about, np.frombuffer(frame[4 + length :], "<f8").reshape(about["arrays"], -1)

    return read
