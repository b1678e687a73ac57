"""CANSimple nodes as a board: commands, measurements, and faults of a node."""

import contextlib
import struct
import time

import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.drivers import daq_stc
from rtctl.drivers.at_mio_16de import AnalogInputParams, AnalogOutputParams, AnalogOutputSettings
from rtctl.drivers.board import BoardError, Quantity, Wiring
from rtctl.drivers.can import CanBoard, CanSettings, connect
from rtctl.tick import frames

HALF = 1 << 15
DESCRIBED = Wiring(
    outputs=(Quantity("motor", "Nm", AnalogOutputParams(2.0 / HALF, -HALF, HALF - 1, 0, 0.0, 0.0)),),
    inputs=(Quantity("tacho", "", AnalogInputParams(1e-3, -(2**31) + 1, 2**31 - 1, 0, 0.0, 0)),),
    counters=1, drives=("motor",), sensors=("encoder", "tacho"), measures=("position", "speed"),
    turns=(8192.0, 2 * np.pi),
)  # fmt: skip
GIVEN = {"nodes": {"motor": {"id": 5, "scale": 0.5}}, "sensors": {"encoder": {"id": 5}, "tacho": {"id": 5}}}


@pytest.fixture
def frame():
    return np.zeros(1, frames.INPUTS)[0]


@pytest.fixture
def bench():
    """`bench(timeout=0.1)`: an open board with node 5, and the node."""
    from odrive_nodes import Nodes, pair

    made = []

    def make(opened=True, rate=200.0, given=GIVEN, prepare=lambda node: None, **settings):
        ours, theirs = pair()
        nodes = Nodes(theirs, 5)
        prepare(nodes.nodes[5])
        made.append((nodes, ours))
        with nodes.lock, contextlib.suppress(BlockingIOError):
            while ours.recv(16):  # discard queued heartbeats
                pass
        card = CanBoard(CanSettings.model_validate({"timeout": 0.5, **given, **settings}), DESCRIBED, rate, ours)
        return (card.open() if opened else card), nodes

    yield make
    for nodes, ours in made:
        nodes.close()
        ours.close()


def until_it_fails(card, frame, seconds=5.0):
    """Run turns of the board until one fails."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        card.write((100,), 0)
        card.read(frame)
    pytest.fail(f"nothing failed in {seconds} s")


def test_can_units_of_a_described_machine(bench, frame):
    """0.5 Nm per unit of command, 8192 counts per turn from the start position, rad/s of the tachometer."""
    card, nodes = bench(prepare=lambda node: setattr(node, "position", 3.25))
    card.write((HALF // 2,), 0)
    assert nodes[5].torque == pytest.approx(0.5 * 1.0)
    nodes.nodes[5].position, nodes.nodes[5].speed = 3.75, -1.5
    card.read(frame)
    assert frame["counter_codes"][0] == daq_stc.INITIAL_COUNT + 4096
    assert frame["ai_codes"][0] == round(-1.5 * 2 * np.pi / 1e-3)


def test_node_is_in_torque_mode_only_while_the_machine_is_on(bench):
    card, nodes = bench()
    assert (nodes[5].state, nodes[5].mode, nodes.cleared) == (1, (1, 1), 1)
    card.enable(True)
    assert nodes[5].state == 8
    card.enable(False)
    assert nodes[5].state == 1


def test_node_in_velocity_mode(bench):
    given = {**GIVEN, "nodes": {"motor": {"id": 5, "input": "velocity", "scale": -2.0}}}
    card, nodes = bench(given=given)
    card.write((HALF // 2,), 0)
    assert (nodes[5].mode, nodes[5].speed_input, nodes[5].torque) == ((2, 1), -2.0, 0.0)


def test_nodes_with_cyclic_messages_are_read(bench, frame):
    def sends(node):
        node.silent.add(0x14)

    card, nodes = bench(opened=False, ask=False, prepare=sends)

    def move(now):
        nodes.send(5, 0x09, struct.pack("<ff", 0.5, 0.0))

    nodes.move = move
    card.open()
    card.write((0,), 0)
    card.read(frame)
    assert frame["counter_codes"][0] == daq_stc.INITIAL_COUNT
    nodes.move = lambda now: nodes.send(5, 0x09, struct.pack("<ff", 1.5, 0.0))
    end = time.monotonic() + 5
    while frame["counter_codes"][0] != daq_stc.INITIAL_COUNT + 8192 and time.monotonic() < end:
        card.read(frame)
    assert frame["counter_codes"][0] == daq_stc.INITIAL_COUNT + 8192


def silent(node):
    node.silent.add(0x09)


def late(node):
    node.delay = 0.6


def no_heartbeat(node):
    node.silent.add(0x01)


def faulty(node):
    node.error = 0x200


def garbled(node):
    node.short.add(0x09)


def not_a_number(node):
    node.position = float("nan")


@pytest.mark.parametrize(
    ("spoil", "settings", "words"),
    [
        (
            silent,
            {"timeout": 0.3},
            r"node 5 \(motor, encoder, tacho\) has sent no encoder estimates for [3-9]\d\d ms, .* is 300 ms",
        ),
        (late, {"timeout": 0.3}, r"has sent no encoder estimates for [3-9]\d\d ms"),
        (no_heartbeat, {}, r"node 5 .* has sent no heartbeat for 1 s"),
        (faulty, {}, r"node 5 .* reports error 0x200 \(bus voltage too low\)"),
        (garbled, {}, r"node 5 sent encoder estimates \(0x0A9\) of 4 bytes, not valid in CANSimple"),
        (not_a_number, {}, r"node 5 sent encoder estimates \(0x0A9\) of 8 bytes, not valid in CANSimple"),
    ],
)
def test_faulty_node_ends_the_board_with_zero_input(bench, frame, spoil, settings, words):
    card, nodes = bench(**settings)
    card.enable(True)
    card.write((1000,), 0)
    card.read(frame)
    spoil(nodes.nodes[5])
    with pytest.raises(BoardError, match=words) as error:
        until_it_fails(card, frame)
    assert card.failed is error.value
    assert (nodes[5].torque, nodes[5].state) == (0.0, 1)


def test_node_that_does_not_enter_closed_loop_control_is_an_error(bench, frame):
    card, _nodes = bench(prepare=lambda node: setattr(node, "stubborn", True))
    card.enable(True)
    with pytest.raises(BoardError, match=r"node 5 \(motor\) is not in closed loop control but idle; was it calibrated"):
        until_it_fails(card, frame)


def test_foreign_frames_are_ignored(bench, frame):
    card, nodes = bench()
    nodes.nodes[7] = nodes.nodes[5]
    nodes.send(7, 0x09, struct.pack("<f", 1.0))
    nodes.send(5, 0x17, b"ab")
    card.write((1,), 0)
    card.read(frame)
    assert frame["counter_codes"][0] == daq_stc.INITIAL_COUNT
    del nodes.nodes[7]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (no_heartbeat, r"node 5 .* sends no heartbeat at can0 within 1 s; is it powered"),
        (faulty, r"node 5 .* has an error: error 0x200 \(bus voltage too low\); see odrivetool"),
        (silent, r"node 5 .* answers no request for encoder estimates within 1 s"),
    ],
)
def test_faulty_node_is_refused_at_the_start(bench, spoil, words):
    with pytest.raises(UserError, match=words):
        bench(prepare=spoil)


def test_node_with_late_answers_is_refused_at_the_start(bench):
    """The samples arrive at the nominal rate with a constant delay, which cannot be detected later."""
    with pytest.raises(UserError, match=r"the nodes answer after \d+ ms, and driver.timeout is 300 ms"):
        bench(timeout=0.3, prepare=late)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"nodes": {"moter": {"id": 5}}}, "driver.nodes.moter: the machine has no such drive; did you mean 'motor'"),
        ({"nodes": {}}, r"driver.nodes.motor is missing: say which node of the bus it is"),
        ({"sensors": {"encoder": {"id": 5}}}, "driver.sensors.tacho is missing"),
    ],
)
def test_node_map_must_match_the_drives_and_sensors_of_the_machine(given, words):
    with pytest.raises(UserError, match=words):
        CanBoard(CanSettings.model_validate({**GIVEN, **given}), DESCRIBED, 200.0)


def test_input_of_a_refused_node_is_zeroed(bench):
    """As after the death of a board process: a silent node may still receive."""
    seen = []

    def runs_away(node):
        node.torque, node.state = 1.0, 8
        node.silent.add(0x01)
        seen.append(node)

    with pytest.raises(UserError, match="sends no heartbeat"):
        bench(prepare=runs_away)
    assert (seen[0].torque, seen[0].state) == (0.0, 1)


def test_cleared_node_error_is_accepted(bench):
    card, nodes = bench(opened=False, prepare=faulty)
    take = nodes._take

    def clears(identifier, remote, data):
        if identifier & 0x1F == 0x18:
            nodes.nodes[5].error = 0
        take(identifier, remote, data)

    nodes._take = clears
    card.open()
    assert nodes.cleared == 1


def test_machine_that_the_bus_cannot_serve_is_refused():
    output = AnalogOutputSettings(channel=0)
    with pytest.raises(UserError, match=r"has no digital lines, and this machine writes 2; use driver.kind serial"):
        CanBoard(CanSettings.model_validate(GIVEN), Wiring((output,), lines=(2,), drives=("motor",)), 200.0)
    with pytest.raises(UserError, match=r"driver.sensors.encoder.per_turn is missing: give the counts, or the metres"):
        CanBoard(CanSettings.model_validate(GIVEN), DESCRIBED._replace(turns=(None, 1.0)), 200.0)
    with pytest.raises(UserError, match="no message of CANSimple shows the acceleration"):
        CanBoard(CanSettings.model_validate(GIVEN), DESCRIBED._replace(measures=("position", "acceleration")), 200.0)
    two = DESCRIBED._replace(drives=("motor", "other"))
    with pytest.raises(UserError, match="node 5 is given to two drives"):
        CanBoard(CanSettings.model_validate({**GIVEN, "nodes": {"motor": {"id": 5}, "other": {"id": 5}}}), two, 200.0)


def test_unavailable_can_interface_is_an_error():
    with pytest.raises(UserError, match=r"driver.interface: (there is no nocan7|this kernel has no CAN)"):
        connect("nocan7")
    with pytest.raises(UserError, match=r"driver.interface: nothing listens at /nowhere"):
        connect("unix:/nowhere")
