"""Virtual time waits for the reader of the ring; a slow reader loses no rows."""

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np


def test_slow_reader_holds_virtual_time_and_loses_no_rows(
    config: Callable[..., Any], bench: Callable[..., Any]
) -> None:
    made = bench(config(), rows=1000)
    ticks = 4500
    thread = threading.Thread(target=made.loop.virtual, args=(ticks,))
    thread.start()
    rows = []
    while thread.is_alive():
        before = int(made.segment["ring"][0]["head"])
        time.sleep(0.005)
        if int(made.segment["ring"][0]["head"]) == before:  # the loop waits for the reader
            rows.append(made.reader.take())
    rows.append(made.reader.take())
    thread.join()
    assert made.reader.lost == 0
    assert (np.concatenate(rows)["tick"] == np.arange(ticks)).all()
    assert made.status["ended"] == 1


def test_loop_stops_while_it_waits_for_the_reader(config: Callable[..., Any], bench: Callable[..., Any]) -> None:
    made = bench(config(), rows=1000)
    thread = threading.Thread(target=made.loop.virtual, args=(10**6,))
    thread.start()
    while thread.is_alive() and int(made.segment["ring"][0]["head"]) < 900:
        time.sleep(0.001)
    made.status["stop"] = 1
    thread.join(10)
    assert not thread.is_alive() and made.status["ended"] == 1
