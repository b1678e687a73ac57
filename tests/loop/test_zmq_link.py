import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import zmq

from rtctl.daemon.child import LINK_WAITING, link_socket
from rtctl.idiom import tick
from rtctl.loop import generate, zmq_link
from rtctl.tick import clock, frames


class Ends:
    """Loop and plant of a link, each with its frames."""

    def __init__(self, plant: zmq.Socket, loop: zmq.Socket):
        self.plant, self.loop = plant, loop
        self.rx = generate.new_frames()
        self.tx = generate.new_frames()["tx"]

    def send(self, seq: int, **fields: Any) -> bool:
        self.tx["seq"] = seq
        for name, value in fields.items():
            self.tx[name] = value
        return zmq_link.send(self.loop.underlying, self.tx)

    def newest(self) -> int:
        return zmq_link.receive_newest(self.plant.underlying, self.rx["tx"], self.rx["tx_staged"])

    def wait(self) -> int:
        return zmq_link.receive(self.plant.underlying, self.rx["tx"], self.rx["tx_staged"])

    @property
    def got(self) -> Any:
        return self.rx["tx"][0]


@pytest.fixture(params=["ipc", "tcp"])
def ends(request: pytest.FixtureRequest, tmp_path: Any) -> Iterator[Ends]:
    context = zmq.Context()
    endpoint = f"ipc://{tmp_path}/l" if request.param == "ipc" else "tcp://127.0.0.1:*"
    plant = link_socket(context, endpoint, True, 2.0, None)
    loop = link_socket(context, plant.get_string(zmq.LAST_ENDPOINT), False, 2.0, None)
    yield Ends(plant, loop)
    context.destroy(linger=0)


def test_zmq_frame_arrives_unchanged(ends: Ends) -> None:
    assert ends.send(7, t_ns=-(2**40), ao_codes=[-2048, 2047, 5, -5], dio_lines=0xFFFFFFFF, state=2)
    assert ends.wait() == 1
    assert ends.got.tobytes() == ends.tx.tobytes()


def test_newest_frame_is_received(ends: Ends) -> None:
    ends.send(1)
    ends.wait()
    for seq in (2, 3, 4):
        ends.send(seq)
    fresh = 0
    while ends.got["seq"] != 4:
        ends.plant.poll(2000)
        fresh += ends.newest()
    assert fresh == 3 and ends.newest() == 0
    assert ends.got["seq"] == 4


@pytest.mark.parametrize("wrong", [{"magic": 1}, {"version": frames.VERSION + 1}])
def test_foreign_frames_are_ignored(ends: Ends, wrong: dict[str, int]) -> None:
    ends.send(1, ao_codes=5)
    ends.wait()
    foreign = ends.tx.copy()
    foreign["seq"] = 2
    foreign["ao_codes"] = 99
    for name, value in wrong.items():
        foreign[name] = value
    assert zmq_link.send(ends.loop.underlying, foreign)
    ends.plant.poll(2000)
    assert ends.newest() == 0
    assert ends.got["seq"] == 1 and (ends.got["ao_codes"] == 5).all()
    ends.send(3)
    assert ends.wait() == 1 and ends.got["seq"] == 3


@pytest.mark.parametrize("length", [0, 1, frames.OUTPUTS.itemsize - 1, frames.OUTPUTS.itemsize + 1, 4096])
def test_message_of_wrong_length_is_ignored(ends: Ends, length: int) -> None:
    """The message starts with a valid frame; only its length is wrong."""
    ends.send(1)
    ends.wait()
    good = ends.tx.copy()
    good["seq"] = 2
    ends.loop.send((good.tobytes() * 60)[:length])
    ends.plant.poll(2000)
    assert ends.newest() == 0 and ends.got["seq"] == 1


@tick
def ping(socket, tx, rx, staged, rounds, pause):
    """Send and receive a reply that has already arrived; returns the number of complete rounds."""
    for k in range(rounds):
        tx[0].seq = k
        if not zmq_link.send(socket, tx):
            return k
        until = clock.now() + pause
        while clock.now() < until:
            pass
        if zmq_link.receive(socket, rx, staged) == 0 or rx[0].seq != k:
            return k
    return rounds


@tick
def pong(socket, rx, tx, staged, rounds):
    for k in range(rounds):
        if zmq_link.receive(socket, rx, staged) == 0:
            return k
        tx[0].seq = rx[0].seq
        if not zmq_link.send(socket, tx):
            return k
    return rounds


@pytest.mark.parametrize("pause", [0, 70_000])
def test_no_frame_is_dropped_in_lockstep(ends: Ends, pause: int) -> None:
    """A socket that never waits for a frame learns late of an empty queue; lockstep would block."""
    loop, plant = generate.new_frames(), generate.new_frames()
    there = (ends.loop.underlying, loop["tx"], loop["rx"], loop["rx_staged"])
    back = (ends.plant.underlying, plant["tx"], plant["rx"], plant["tx_staged"])
    ping(*there, 0, 0)
    pong(*back, 0)  # both compiled
    found: list[int] = []
    thread = threading.Thread(target=lambda: found.append(pong(*back, 1000)))
    thread.start()
    assert ping(*there, 1000, pause) == 1000
    thread.join(10)
    assert found == [1000]


def test_sending_never_waits_for_a_peer(tmp_path: Any) -> None:
    context = zmq.Context()
    alone = link_socket(context, f"ipc://{tmp_path}/nobody", False, 1.0, None)
    tx = generate.new_frames()["tx"]
    begun = time.monotonic()
    taken = [zmq_link.send(alone.underlying, tx) for _ in range(1000)]
    assert time.monotonic() - begun < 2.0  # far less than a thousand waits of a second
    assert sum(taken) <= LINK_WAITING and not taken[-1]
    context.destroy(linger=0)


def test_flood_of_messages_does_not_delay_the_tick(ends: Ends) -> None:
    ends.send(1)
    ends.wait()
    stop = threading.Event()

    def flood() -> None:
        frame = np.frombuffer(ends.tx.tobytes(), frames.OUTPUTS).copy()
        while not stop.is_set():
            zmq_link.send(ends.loop.underlying, frame)

    thread = threading.Thread(target=flood)
    thread.start()
    try:
        assert all(ends.newest() <= zmq_link.MOST for _ in range(200))
    finally:
        stop.set()
        thread.join()


def test_wait_ends_at_the_socket_timeout(ends: Ends) -> None:
    ends.plant.set(zmq.RCVTIMEO, 20)
    assert ends.wait() == 0
