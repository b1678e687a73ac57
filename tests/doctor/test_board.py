import io
import os
import sys
from pathlib import Path

import pytest
from rich.console import Console

from rtctl.config.errors import UserError
from rtctl.doctor import board, board_console
from rtctl.doctor.board import Sample, Step
from rtctl.doctor.finding import Finding
from rtctl.drivers import optical_sensor
from rtctl.drivers.board import BoardError
from rtctl.machines.wiring import wiring

sys.path.insert(0, str(Path(__file__).parents[1] / "drivers"))
import rigs

CAPSTAN = 10_000  # counts a turn
ENCODER, SCALE = 106_103, 200_000  # counts for 100 mm: 5.3 turns of 20000, 0.5 um each


class Hands:
    """Stub of the operator: the actions of a test by step name; answers yes to every other step."""

    def __init__(self, does, says=True):
        self.does, self.says = does, says

    def act(self, step, read):
        if step.name not in self.does:
            return False
        self.does[step.name](read)
        return True

    def confirm(self, step):
        return self.says


def turn(rig, channel, sensor, pulses):
    """A reel turned by hand past its sensor, with reads during the turn."""
    p = optical_sensor.build(sensor, 1.0)

    def act(read):
        for n in range(pulses * 20 + 1):
            rig.set_input(channel, optical_sensor.volts.py_func(p, n * p.radians_per_count / 20))
            read()

    return act


def moved(rig, **counters):
    def act(read):
        for name, pulses in counters.items():
            rig.pulse(int(name[1:]), pulses)
            read()

    return act


@pytest.fixture
def ivu(config):
    settings = config("ivu", mode="real")
    rig = rigs.emulated(wiring(settings))
    rig.card.open()
    return settings, rig


def verdicts(found):
    return {f.name: f.verdict for f in found}


def checks(settings, rig, does, says=True):
    heard = []
    found = board.run(settings, rig.card, Hands(does, says), heard.append)
    assert heard == found
    return found


def right(settings, rig):
    sensors = settings.sensors
    return {
        "capstan": moved(rig, c0=CAPSTAN - 60),
        "capstan, back": moved(rig, c0=-CAPSTAN + 80),
        "reel1": turn(rig, 0, sensors.reel1, sensors.reel1.pulses),
        "reel2": turn(rig, 1, sensors.reel2, sensors.reel2.pulses),
    }


def test_correctly_wired_machine_passes(ivu):
    settings, rig = ivu
    found = checks(settings, rig, right(settings, rig))
    assert set(verdicts(found).values()) == {"good"}
    assert [f.name for f in found] == [
        "card", "emergency stop", "outputs", "rest", "capstan", "capstan, back", "reel1", "reel2",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "act", "words"),
    [
        ("capstan", lambda rig, s: moved(rig, c0=-CAPSTAN), "the wrong way: swap A and B"),
        ("capstan", lambda rig, s: moved(rig, c0=0), "none at all"),
        ("capstan", lambda rig, s: moved(rig, c0=CAPSTAN // 4), "0.25 of what it should be: lines, x1 or x4"),
        ("capstan, back", lambda rig, s: moved(rig, c0=-CAPSTAN // 2), "-5000 counts"),
        ("reel1", lambda rig, s: turn(rig, 1, s.sensors.reel1, 12), "it does not change: is the sensor fed"),
        ("reel2", lambda rig, s: turn(rig, 1, s.sensors.reel2, 2), "2 pulses"),
    ],
)
def test_wiring_error_is_found_and_reported(ivu, name, act, words):
    settings, rig = ivu
    found = checks(settings, rig, {**right(settings, rig), name: act(rig, settings)})
    assert [n for n, verdict in verdicts(found).items() if verdict == "bad"] == [name]
    bad = next(f for f in found if f.name == name)
    assert words in bad.found
    assert bad.change.startswith("right is: ")


def test_input_that_jumps_at_rest_is_bad(ivu):
    settings, rig = ivu
    noise = iter([0.0, 0.5, 0.1] * 10_000)
    read = rig.card._read_volts
    rig.card._read_volts = lambda: [v + next(noise) for v in read()]
    assert verdicts(checks(settings, rig, right(settings, rig)))["rest"] == "bad"


def test_ldu_scale_and_encoder_are_compared(config):
    settings = config("ldu", mode="real")
    rig = rigs.emulated(wiring(settings))
    rig.card.open()
    does = {
        "scale": moved(rig, c1=SCALE),
        "scale, back": moved(rig, c1=-SCALE),
        "encoder": moved(rig, c0=ENCODER, c1=SCALE),
    }
    assert set(verdicts(checks(settings, rig, does)).values()) == {"good"}
    found = checks(settings, rig, {**does, "encoder": moved(rig, c0=-ENCODER, c1=SCALE)})
    assert "against each other" in found[-1].found
    assert found[-1].verdict == "bad"


def test_unattended_check_judges_the_rest_state_and_lists_the_manual_steps(ivu):
    settings, rig = ivu
    found = board.run(settings, rig.card, None, lambda _: None)
    assert verdicts(found) == {
        **dict.fromkeys((s.name for s in board.steps(settings)), "unknown"), "card": "good", "rest": "good",
    }  # fmt: skip
    assert all(f.change for f in found if f.verdict == "unknown")


def test_negative_answer_of_the_operator_is_a_bad_verdict(ivu):
    settings, rig = ivu
    assert verdicts(checks(settings, rig, {}, says=False))["emergency stop"] == "bad"
    assert verdicts(checks(settings, rig, {}, says=None))["emergency stop"] == "unknown"


def test_wiring_check_writes_only_zero_outputs(ivu):
    settings, rig = ivu
    written = []
    write = rig.card._write_code
    rig.card._write_code = lambda n, code: (written.append(code), write(n, code))
    checks(settings, rig, right(settings, rig))
    assert set(written) == {0}
    assert len(written) > 10


def test_card_failure_during_the_check_is_an_error(ivu):
    settings, rig = ivu
    rig.fail("counters")
    with pytest.raises(BoardError, match="pulled out"):
        checks(settings, rig, right(settings, rig))


def test_emulated_board_has_no_wiring_check(config):
    with pytest.raises(UserError, match="has an emulated board, which has no wires"):
        board.card_of(config("ivu"))


class Keyboard:
    """Terminal lines from a pipe, so a wait for input works."""

    def __init__(self, text):
        reading, writing = os.pipe()
        os.write(writing, text.encode())
        os.close(writing)
        self.file = os.fdopen(reading)


@pytest.fixture
def console():
    return Console(file=io.StringIO(), width=100)


STEP = Step("capstan", "Turn the capstan.", "one turn", lambda samples: ("", True))


@pytest.mark.parametrize(("text", "done"), [("\n", True), ("s\n", False), ("", False)])
def test_enter_ends_a_step_and_s_skips_it(console, text, done):
    seen = []

    def read():
        seen.append(1)
        return Sample((3,), (1.5,))

    keyboard = Keyboard(text)
    assert board_console.Terminal(console, keyboard.file).act(STEP, read) is done
    assert seen
    assert "Turn the capstan." in console.file.getvalue()
    keyboard.file.close()


@pytest.mark.parametrize(("text", "said"), [("y\n", True), ("what\nno\n", False), ("s\n", None), ("", None)])
def test_question_is_repeated_until_answered(console, text, said):
    keyboard = Keyboard(text)
    assert board_console.Terminal(console, keyboard.file).confirm(STEP) is said
    keyboard.file.close()


def test_findings_are_printed_with_the_correct_wiring(console):
    board_console.tell(console, Finding("capstan", "-9 counts", "bad", "", "right is: +10000 counts"))
    assert console.file.getvalue().split() == ["bad", "capstan:", "-9", "counts", "right", "is:", "+10000", "counts"]


@pytest.mark.parametrize(("turns", "good"), [(0.5, True), (-0.5, False), (0.0, False)])
def test_described_machine_on_a_bus_is_checked_by_hand_without_terminals(turns, good):
    from odrive_nodes import Nodes, pair

    from rtctl.cli.common import load_config
    from rtctl.drivers.can import CanBoard

    config = load_config("boards/axis_odrive", ["driver.timeout=0.5 s"])
    ours, theirs = pair()
    nodes = Nodes(theirs, 1)
    card = CanBoard(config.driver, wiring(config), 200.0, ours).open()

    def hand(read):
        nodes.nodes[1].position += turns
        read()

    try:
        found = board.run(config, card, Hands({"encoder": hand}), lambda _: None)
    finally:
        card.close()
        nodes.close()
        ours.close()
    assert [f.name for f in found] == ["card", "emergency stop", "rest", "encoder"]
    assert (found[-1].verdict == "good") == good
    assert f"{8192 * turns:+.0f} counts" in str(found[-1]) and nodes.nodes[1].torque == 0.0
