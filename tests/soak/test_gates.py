"""Every soak gate can fail: a planted regression for each invariant is reported by name."""

import mmap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl.soak.events import Day
from rtctl.soak.invariants import INVARIANTS
from rtctl.soak.memory import MOST_MB, Memory
from rtctl.soak.rig import Fused
from rtctl.tick import safety

Make = Callable[..., Fused]
Only = Callable[..., None]


def play(rig: Fused, events: int, with_faults: bool = True) -> Day:
    """Run some events of a soak."""
    day = Day(rig, 1, with_faults)
    for _ in range(events):
        day.step()
    rig.checker.flush()
    return day


def names(rig: Fused) -> set[str]:
    """Names of the violated invariants."""
    return {v.name for v in rig.checker.kept}


def params(rig: Fused, block: str, **values: float) -> None:
    """Parameters of the tick, changed without a change of the config."""
    post = rig.mailbox.post

    def tamper(write: Any) -> None:
        def wrong(records: Any, command: Any) -> None:
            write(records, command)
            for name, value in values.items():
                records[block][name] = value

        post(wrong)

    rig.mailbox.post = tamper  # type: ignore[method-assign]


def tampered(rig: Fused, change: Callable[[np.ndarray], np.ndarray], monkeypatch: pytest.MonkeyPatch) -> None:
    """Modify the rows read from the ring."""
    take = rig.reader.take
    monkeypatch.setattr(rig.reader, "take", lambda: change(take()))


def test_correct_machine_has_no_violations(rig: Make, only: Only) -> None:
    only("move", "ramp", "switch", "fault")
    found = rig()
    play(found, 12)
    assert not found.checker.kept and found.checker.count == 0


def test_disabled_output_limit_is_found(rig: Make, only: Only) -> None:
    only("move")
    found = rig(set={"law.limit.high": 0.5})
    params(found, "limit", high=10.0, low=-10.0)
    play(found, 3)
    assert "output_limits" in names(found)
    worst = next(v for v in found.checker.kept if v.name == "output_limits")
    assert abs(worst.value) > 0.5 > abs(worst.bound) - 0.01 and worst.signals["tick"] == worst.tick


def test_outputs_on_after_a_trip_are_found(rig: Make, only: Only) -> None:
    only("fault", faults=["encoder.freeze", "link.silent"])
    found = rig()
    params(found, "safety", fade=0.0)
    play(found, 12)
    assert "outputs_off" in names(found)


def test_fading_outputs_are_not_a_violation(rig: Make, only: Only) -> None:
    only("fault", faults=["encoder.freeze", "link.silent"])
    found = rig(set={"safety.ramp": 0.5})
    day = play(found, 12)
    assert sum(day.tripped.values()) > 0 and not names(found)


def test_nan_in_one_row_is_found(rig: Make, only: Only, monkeypatch: pytest.MonkeyPatch) -> None:
    def break_one(rows: np.ndarray) -> np.ndarray:
        rows["w"][(rows["tick"] == 1000) | (rows["tick"] == 2000)] = np.nan
        return rows

    only("move")
    found = rig()
    tampered(found, break_one, monkeypatch)
    play(found, 3)
    assert [(v.name, v.tick) for v in found.checker.kept] == [("finite", 1000), ("finite", 2000)]


def test_tension_without_a_trip_is_found(rig: Make, only: Only) -> None:
    only("move")
    found = rig(set={"safety.tension_max": 0.12})
    params(found, "safety", tension_max=1e9)
    play(found, 2)
    assert "tension" in names(found)


def test_lost_encoder_counts_are_found(rig: Make, only: Only) -> None:
    only("ramp")
    found = rig(set={"sensors.capstan.pulse_width": 1e-3})
    play(found, 4)
    assert "counters" in names(found)


def test_gap_in_the_ring_is_found(rig: Make, only: Only, monkeypatch: pytest.MonkeyPatch) -> None:
    only("move")
    found = rig()
    tampered(found, lambda rows: rows[rows["tick"] != 1000], monkeypatch)
    play(found, 2)
    assert names(found) == {"ring"}
    assert (found.checker.kept[0].tick, found.checker.kept[0].bound) == (1001, 1000)


def test_late_reader_loses_rows_and_counts_them(rig: Make) -> None:
    found = rig()
    found.ask("arm")
    found.run(500)
    found.loop.stretch(found.tick, 3 * len(found.segment["rows"]))  # no reads during this time
    found.run(500)
    carry = found.checker.carry
    assert carry["lost"] > 0 and carry["rows"] + carry["lost"] == found.tick == carry["tick"]
    assert "ring" not in names(found)


def test_arming_without_a_command_is_found(rig: Make) -> None:
    def arm(_: Any, command: Any) -> None:
        command["arm"] += 1

    found = rig()
    found.run(100)
    found.mailbox.post(arm)
    found.run(100)
    assert {"state_machine", "order"} == names(found)


def test_trip_that_loses_its_cause_is_found(rig: Make, only: Only, monkeypatch: pytest.MonkeyPatch) -> None:
    def forget(rows: np.ndarray) -> np.ndarray:
        tripped = np.flatnonzero(rows["state"] == safety.TRIPPED)
        rows["trip"][tripped[2:]] = safety.CURRENT
        return rows

    only("fault", faults=["link.silent"])
    found = rig()
    tampered(found, forget, monkeypatch)
    play(found, 6)
    assert names(found) == {"trip_latched"}


def test_trip_without_a_cause_is_found(rig: Make, only: Only) -> None:
    only("move")
    found = rig()
    params(found, "safety", following=1e-3)
    play(found, 2)
    assert "trip_without_cause" in names(found)


def test_link_timeout_of_a_day_is_found(rig: Make, only: Only) -> None:
    only("fault", faults=["link.silent"])
    found = rig(set={"safety.link_timeout": 86400.0, "safety.following_error": 0.0, "safety.frozen_time": 0.0})
    play(found, 25)
    assert "must_trip" in names(found)


@pytest.mark.parametrize(
    ("fault", "block"),
    [("loop.stall", {"missed": 0}), ("encoder.freeze", {"following": 0.0, "frozen": 0})],
)
def test_trip_disabled_without_the_config_is_found(rig: Make, only: Only, fault: str, block: dict[str, float]) -> None:
    only("fault", faults=[fault])
    found = rig()
    params(found, "safety", **block)
    play(found, 12)
    assert "must_trip" in names(found)


def test_wrong_setpoint_is_found(rig: Make, only: Only, monkeypatch: pytest.MonkeyPatch) -> None:
    only("move")
    found = rig()
    setpoint = found.setpoint
    monkeypatch.setattr(found, "setpoint", lambda target, rate: setpoint(target + 0.2, rate))
    play(found, 2)
    assert names(found) == {"settled"}


def test_decreasing_order_number_is_found(rig: Make, only: Only, monkeypatch: pytest.MonkeyPatch) -> None:
    def older(rows: np.ndarray) -> np.ndarray:
        rows["order"][rows["tick"] == 3000] -= 1
        return rows

    only("move")
    found = rig()
    tampered(found, older, monkeypatch)
    play(found, 3)
    assert [(v.name, v.tick) for v in found.checker.kept] == [("order", 3000)]


def test_reset_without_effect_is_found(rig: Make, only: Only, monkeypatch: pytest.MonkeyPatch) -> None:
    only("fault", faults=["link.silent"])
    found = rig()
    ask = found.ask
    monkeypatch.setattr(found, "ask", lambda request: None if request == "reset" else ask(request))
    play(found, 6)
    assert names(found) == {"recovery"}


def test_memory_leak_is_found(rig: Make, only: Only, monkeypatch: pytest.MonkeyPatch) -> None:
    only("wait")
    found = rig()
    memory, kept = Memory(), []
    for k in range(80):
        kept.append(
            mmap.mmap(-1, size := round(MOST_MB / 20 * 2**20))
        )  # new memory, not memory cached by the allocator
        kept[-1].write(bytes(size))
        memory.sample(k / 80, found.checker, k)
    assert names(found) == {"memory"} and found.checker.count == 1


def test_each_invariant_has_a_planted_regression() -> None:
    text = Path(__file__).read_text(encoding="utf-8")
    assert not [name for name in INVARIANTS if f'"{name}"' not in text]
