"""Trips in the log: each once, with its cause, its tick and the signals of the machine."""

import numpy as np
from structlog.testing import capture_logs

from rtctl.daemon.events import Trips
from rtctl.loop import safety

ROW = np.dtype([("tick", "<i8"), ("t", float), ("trip", float), ("link_age", float), ("x", float), ("truth_x", float)])


def rows(trips: list[int], first: int = 0) -> np.ndarray:
    made = np.zeros(len(trips), ROW)
    made["tick"] = np.arange(first, first + len(trips))
    made["t"], made["trip"], made["x"] = made["tick"] * 1e-3, trips, made["tick"] + 1 / 3
    return made


def test_each_trip_is_logged_once_with_the_signals_of_its_tick() -> None:
    trips = Trips()
    with capture_logs() as said:
        trips.feed(rows([0, 0, safety.FOLLOWING, safety.FOLLOWING]))
        trips.feed(rows([safety.FOLLOWING, 0, 0], 4))
        trips.feed(rows([safety.LINK], 7))
    assert [(s["event"], s["cause"], s["tick"], s["t"], s["log_level"]) for s in said] == [
        ("trip", "following_error", 2, 0.002, "error"), ("trip", "link_lost", 7, 0.007, "error")
    ]  # fmt: skip
    assert said[0]["x"] == 2.3333 and "truth_x" not in said[0] and "link_age" not in said[0]
    assert said[0]["why"] == safety.TRIPS[safety.FOLLOWING][1]
