"""A shift of the reel unit on virtual time and the learned band, made once for all tests of this folder."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from rtctl import api
from rtctl.watch.band import Band
from rtctl.watch.monitor import Monitor
from rtctl.watch.rehearsal import Moves, Shift, usual

LEARNED = 150.0  # s in motion: enough for detection tests, too short for a false-alarm rate


class Rehearsed(NamedTuple):
    config: Any
    moves: Moves
    case: dict[str, Any]
    band: Band
    rows: np.ndarray  # rows of the learning phase
    after: np.ndarray  # the next 120 s of the healthy machine


@pytest.fixture(scope="session")
def rehearsed() -> Rehearsed:
    config = api.load_config("ivu")
    shift, rng = Shift(config), np.random.default_rng(1)
    moves = usual(config)
    monitor = Monitor(shift.case, seconds=LEARNED)
    parts = []
    while monitor.band is None:
        parts.append(shift.play(moves, rng, 60.0))
        monitor.feed(parts[-1])
    return Rehearsed(config, moves, shift.case, monitor.band, np.concatenate(parts), shift.play(moves, rng, 120.0))
