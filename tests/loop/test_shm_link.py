import platform
import threading
from typing import Any

import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.idiom import tick
from rtctl.loop import generate, shm_link
from rtctl.tick import frames


class Ends:
    """Both ends of a slot for outputs."""

    def __init__(self) -> None:
        self.slot = np.zeros(1, shm_link.OUTPUTS_SLOT)
        self.tx = generate.new_frames()["tx"]
        self.rx = generate.new_frames()

    def send(self, seq: int, **fields: Any) -> bool:
        self.tx["seq"] = seq
        for name, value in fields.items():
            self.tx[name] = value
        return shm_link.send(self.slot, self.tx)

    def newest(self) -> int:
        return shm_link.receive_newest(self.slot, self.rx["tx"], self.rx["tx_staged"])

    def wait(self) -> int:
        return shm_link.receive(self.slot, self.rx["tx"], self.rx["tx_staged"])

    @property
    def got(self) -> Any:
        return self.rx["tx"][0]


@pytest.fixture
def ends() -> Ends:
    return Ends()


def test_shm_frame_arrives_unchanged_and_once(ends: Ends) -> None:
    assert ends.newest() == 0
    assert ends.send(7, t_ns=-(2**40), ao_codes=[-2048, 2047, 5, -5], dio_lines=0xFFFFFFFF, state=2)
    assert ends.newest() == 1 and ends.got.tobytes() == ends.tx.tobytes()
    assert ends.newest() == 0


def test_newest_frame_is_received_and_the_sender_never_waits(ends: Ends) -> None:
    assert all(ends.send(seq) for seq in range(1000))
    assert ends.newest() == 1 and ends.got["seq"] == 999


@pytest.mark.parametrize(("field", "value"), [("magic", 1), ("version", frames.VERSION + 1), ("seq", frames.HELLO)])
def test_foreign_frames_are_ignored(ends: Ends, field: str, value: int) -> None:
    ends.send(1)
    ends.newest()
    before = ends.got.tobytes()
    ends.send(**{"seq": 2, field: value})
    assert ends.newest() == 0 and ends.got.tobytes() == before


def test_frame_is_not_received_while_it_is_written(ends: Ends) -> None:
    ends.send(1)
    ends.slot["count"] += 1
    assert ends.newest() == 0
    ends.slot["count"] += 1
    assert ends.newest() == 1


def test_frame_count_may_wrap_around(ends: Ends) -> None:
    """The count is a futex word of 32 bits: thirty hours at 10 kHz."""
    ends.slot["count"] = ends.slot["seen"] = 2**31 - 6
    for seq in range(10):
        ends.send(seq)
        assert ends.wait() == 1 and ends.got["seq"] == seq
        assert ends.newest() == 0
    assert ends.slot["count"] < 0


@tick
def ping(out, inp, tx, rx, staged, rounds):
    """Send and wait for the reply; returns the number of correct replies."""
    right = 0
    for k in range(rounds):
        tx[0].seq = k
        tx[0].ao_codes[:] = k
        shm_link.send(out, tx)
        if shm_link.receive(inp, rx, staged) == 1 and rx[0].seq == k and rx[0].ai_codes[15] == k:
            right += 1
    return right


@tick
def pong(inp, out, rx, tx, staged, rounds):
    for _ in range(rounds):
        shm_link.receive(inp, rx, staged)
        tx[0].seq = rx[0].seq
        tx[0].ai_codes[:] = rx[0].ao_codes[1]
        shm_link.send(out, tx)


def test_waiting_receiver_is_woken() -> None:
    outputs, inputs = np.zeros(1, shm_link.OUTPUTS_SLOT), np.zeros(1, shm_link.INPUTS_SLOT)
    loop, plant = generate.new_frames(), generate.new_frames()
    there = (outputs, inputs, loop["tx"], loop["rx"], loop["rx_staged"])
    back = (outputs, inputs, plant["tx"], plant["rx"], plant["tx_staged"])
    ping(*there, 0)
    pong(*back, 0)  # both compiled
    thread = threading.Thread(target=pong, args=(*back, 2000))
    thread.start()
    assert ping(*there, 2000) == 2000
    thread.join(10)
    assert not thread.is_alive()


@pytest.mark.parametrize("first", [True, False])
def test_receiver_waits_for_an_interrupted_sender(ends: Ends, first: bool) -> None:
    if not first:
        ends.send(1)
        ends.wait()
    ends.tx["seq"] = 2
    ends.slot["count"] += 1  # interrupted send; `finish` completes the send

    def finish() -> None:
        ends.slot["frame"] = ends.tx
        ends.slot["count"] -= 1
        shm_link.send(ends.slot, ends.tx)

    shm_link.send(np.zeros(1, shm_link.OUTPUTS_SLOT), ends.tx)  # compiled
    timer = threading.Timer(0.05, finish)
    timer.start()
    assert ends.wait() == 1 and ends.got["seq"] == 2
    timer.join()


@tick
def write_many(slot, frame, count):
    for k in range(1, count + 1):
        frame[0].seq = k
        frame[0].t_ns = k
        frame[0].ao_codes[:] = k
        frame[0].state = k
        shm_link.send(slot, frame)


@tick
def read_many(slot, frame, staged, last):
    """Read newest frames until the last one; returns the number of torn or outdated frames."""
    wrong = 0
    before = 0
    while before < last:
        if shm_link.receive_newest(slot, frame, staged) == 1:
            f = frame[0]
            if (
                f.seq < before
                or f.t_ns != f.seq
                or f.ao_codes[0] != f.seq
                or f.ao_codes[1] != f.seq
                or f.state != f.seq
            ):
                wrong += 1
            before = f.seq
    return wrong


def test_torn_frames_are_never_taken(ends: Ends) -> None:
    write_many(ends.slot, ends.tx, 0)
    last = 100_000
    thread = threading.Thread(target=write_many, args=(ends.slot, ends.tx, last))
    thread.start()
    assert read_many(ends.slot, ends.rx["tx"], ends.rx["tx_staged"], last) == 0
    thread.join()


def test_receiver_does_not_wait_for_an_available_frame(ends: Ends) -> None:
    ends.send(1)
    assert ends.wait() == 1 and ends.got["seq"] == 1


def test_futex_syscall_number_of_each_architecture() -> None:
    """Numbers of futex(2) in the tables of the kernel: arch/x86/entry/syscalls/syscall_64.tbl, asm-generic/unistd.h."""
    assert shm_link.FUTEX == {"x86_64": 202, "aarch64": 98}
    assert shm_link.SYS_FUTEX == shm_link.FUTEX[platform.machine()]


@pytest.mark.parametrize("machine, bits", [("riscv64", 64), ("armv7l", 32), ("aarch64", 32), ("i686", 32)])
def test_processor_without_a_known_futex_number_is_refused(machine: str, bits: int) -> None:
    with pytest.raises(UserError, match=f"{machine} with a {bits}-bit Python.*x86_64 and aarch64"):
        shm_link.check_architecture(machine, bits)
