"""First exchange of loop and plant: samples that waited while the loop compiled are used up before the first tick."""

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zmq

from rtctl.daemon.child import LINK_WAITING, link_socket
from rtctl.daemon.plant_process import Plant
from rtctl.loop import generate
from rtctl.loop.loop import Loop
from rtctl.loop.records import PLANT_STATUS
from rtctl.tick.safety import IDLE, WATCHDOG

pytestmark = pytest.mark.realtime
TICKS = 60


class Linked:
    """A machine in two threads: the loop's, and the emulated plant's, which runs from the start."""

    def __init__(self, made: Any, folder: Path):
        self.bench, self.context = made, zmq.Context()
        generated = generate.generate(made.machine, "zmq")
        near = self.near = link_socket(self.context, f"ipc://{folder}/meet", True, 2.0, None)
        far = self.far = link_socket(self.context, f"ipc://{folder}/meet", False, 2.0, None)
        self.loop = Loop(made.machine, generated, made.segment, far.underlying, far.underlying)
        self.loop.warm()
        self.plant_status = np.zeros(1, PLANT_STATUS)
        self.plant = Plant(made.machine, generated, self.plant_status, near.underlying, near.underlying)
        self.thread = threading.Thread(target=self.plant.run)
        self.thread.start()

    def run(self) -> np.ndarray:
        """Rows of a run of TICKS ticks whose outputs are on from the start."""
        self.bench.ask("arm", "play")
        self.loop.real(TICKS)
        return self.bench.reader.take()

    def close(self) -> None:
        self.plant_status["stop"] = 1
        self.thread.join()
        self.context.destroy(linger=0)


@pytest.fixture
def linked(bench: Callable[..., Any], config: Callable[..., Any], runtime: Path) -> Iterator[Linked]:
    made = Linked(bench(config(mode="real", link="zmq", set={"safety.missed_ticks": 0})), runtime)
    yield made
    made.close()


def test_samples_that_waited_cause_no_trip(linked: Linked) -> None:
    while linked.plant_status["tick"][0] < 6 * LINK_WAITING:  # both queues and the socket are full
        time.sleep(0.01)
    rows = linked.run()
    assert len(rows) == TICKS and not rows["trip"].any()
    assert linked.plant_status["watchdog"][0] == 0


def test_board_watchdog_of_an_earlier_run_causes_no_trip(linked: Linked) -> None:
    record = linked.plant.records[3][0]  # the sample, which carries the counts of the board
    record["watchdog"], record["watchdog_seq"] = 4, 10**6
    rows = linked.run()
    assert len(rows) == TICKS and not rows["trip"].any()


def test_outputs_are_numbered_as_the_board_sees_them(linked: Linked) -> None:
    """The number of the last outputs that were off decides whether a report of the board is about this arming."""
    rows = linked.run()
    sent = int(linked.loop.tx["seq"][0])
    safety = linked.loop.s["safety"][0]
    assert TICKS <= sent and 0 < safety["off_seq"] <= sent - TICKS
    assert rows["state"][0] != IDLE and not (rows["trip"] == WATCHDOG).any()
