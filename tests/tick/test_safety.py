"""Exact tick of every cause of a trip. Limits in ticks of 1 ms."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.loop.mailbox import COMMAND
from rtctl.tick import frames, safety
from rtctl.tick.safety import (
    ARMED,
    COMMANDER,
    CURRENT,
    FOLLOWING,
    FROZEN,
    IDLE,
    LINK,
    MISSED,
    NONE,
    NOT_A_NUMBER,
    RUNNING,
    SUPERVISOR,
    TENSION,
    TRIPPED,
    WATCHDOG,
    SafetySettings,
)

DT = 1e-3
SETTINGS = SafetySettings(
    link_timeout=0.005, frozen_time=0.004, frozen_effort=1.0, following_error=0.5, tension_min=0.0, tension_max=8.0,
    tension_time=0.003, current=1.0, current_time=0.006, missed_ticks=7,
)  # fmt: skip
P = safety.build(SETTINGS, DT)
GOOD: dict[str, Any] = {
    "fresh": 1, "late": 0, "passed": 1, "gone": 0, "watchdog": 0, "lost": 0, "error": 0.0, "effort": 0.5,
    "amperes": 0.2, "T1": 1.0, "T2": 1.0, "moves": True,
}  # fmt: skip


class Machine:
    """The safety state machine, with its calls in the order of a tick."""

    def __init__(self, p: Any = P, state: int = RUNNING):
        self.p, self.s, self.c = p, np.zeros(1, safety.SAFETY_STATE)[0], np.zeros(1, COMMAND)[0]
        self.k = self.counts = 0
        if state != IDLE:
            self.tick(arm=1)
            self.s["state"] = state

    def tick(self, arm: int = 0, disarm: int = 0, reset: int = 0, u: float = 3.0, **signals: Any) -> float:
        """Run one tick; returns the written voltage."""
        x = {**GOOD, **signals}
        self.c["arm"] += arm
        self.c["disarm"] += disarm
        self.c["reset"] += reset
        self.c["commander_lost"] = x["lost"]
        self.counts += bool(x["moves"])
        safety.command(self.s, self.c, x["passed"])
        safety.check_timing(self.p, self.s, self.c, x["fresh"], x["late"], x["gone"], x["watchdog"], self.k)
        safety.check_motion(self.p, self.s, x["error"], self.counts, x["effort"], x["amperes"], self.k)
        safety.check_tension(self.p, self.s, x["T1"], x["T2"], self.k)
        safety.fade(self.p, self.s)
        self.k += 1
        return safety.gate(self.p, self.s, u, 0)

    def trips_after(self, **signals: Any) -> int:
        """Number of the tick with these signals at which the machine trips, from 1; 0 without a trip in 50 ticks."""
        for n in range(1, 51):
            u = self.tick(**signals)
            if self.s["state"] == TRIPPED:
                assert u == 0.0 and self.s["trip_tick"] == self.k - 1
                return n
            assert u == 3.0
        return 0


CAUSES = [
    (LINK, {"fresh": 0}, 6),
    (FROZEN, {"moves": False, "effort": 1.1}, 5),
    (FROZEN, {"moves": False, "effort": -9.0}, 5),
    (FOLLOWING, {"error": 0.51}, 1),
    (FOLLOWING, {"error": -0.51}, 1),
    (TENSION, {"T1": 8.1}, 4),
    (TENSION, {"T2": -0.1}, 4),
    (CURRENT, {"amperes": 1.01}, 7),
    (NOT_A_NUMBER, {"error": np.nan}, 1),
    (NOT_A_NUMBER, {"effort": np.inf, "moves": True}, 1),
    (NOT_A_NUMBER, {"effort": -np.inf, "moves": True}, 1),
    (NOT_A_NUMBER, {"amperes": np.nan}, 1),
    (MISSED, {"late": 1}, 7),
    (COMMANDER, {"lost": 1}, 1),
    (COMMANDER, {"gone": COMMANDER}, 1),
    (SUPERVISOR, {"gone": SUPERVISOR}, 1),
]
UNTIL = [c for c in CAUSES if c[2] > 1]
FINE = [{"effort": 0.9, "moves": False}, {"error": 0.5}, {"T1": 8.0, "T2": 0.0}, {"amperes": 1.0}]


@pytest.mark.parametrize("state", [ARMED, RUNNING])
@pytest.mark.parametrize(("cause", "signals", "ticks"), CAUSES)
def test_each_cause_trips_at_its_tick(cause: int, signals: dict, ticks: int, state: int) -> None:
    machine = Machine(state=state)
    expected = 0 if cause == TENSION and state == ARMED else ticks  # the tape is tightened in state armed
    assert machine.trips_after(**signals) == expected
    assert machine.s["trip"] == (cause if expected else NONE)


@pytest.mark.parametrize(("cause", "signals", "ticks"), UNTIL)
def test_one_good_tick_restarts_the_count(cause: int, signals: dict, ticks: int) -> None:
    machine = Machine()
    for _ in range(3):
        for _ in range(ticks - 1):
            machine.tick(**signals)
        machine.tick()
    assert machine.s["state"] == RUNNING
    assert machine.trips_after(**signals) == ticks


@pytest.mark.parametrize("signals", FINE)
def test_value_at_the_limit_does_not_trip(signals: dict) -> None:
    assert Machine().trips_after(**signals) == 0


@pytest.mark.parametrize(("cause", "signals", "ticks"), CAUSES)
def test_idle_state_never_trips(cause: int, signals: dict, ticks: int) -> None:
    machine = Machine(state=IDLE)
    for _ in range(50):
        assert machine.tick(**signals) == 0.0
    assert machine.s["state"] == IDLE and machine.s["trip"] == NONE


@pytest.mark.parametrize(("cause", "signals", "ticks"), UNTIL)
def test_violations_in_idle_do_not_count_after_arming(cause: int, signals: dict, ticks: int) -> None:
    machine = Machine(state=IDLE)
    for _ in range(50):
        machine.tick(**signals)
    machine.tick(arm=1)
    machine.s["state"] = RUNNING
    assert machine.trips_after(**signals) == ticks


OFF: list[tuple[dict, Callable[[], dict]]] = [
    ({"frozen_time": 0.0}, lambda: {"moves": False, "effort": 9.0}),
    ({"following_error": 0.0}, lambda: {"error": 1e9}),
    ({"current_time": 0.0}, lambda: {"amperes": 1e9}),
    ({"missed_ticks": 0}, lambda: {"late": 1}),
]


@pytest.mark.parametrize(("off", "signals"), OFF)
def test_limit_of_zero_is_off(off: dict, signals: Callable[[], dict]) -> None:
    p = safety.build(SETTINGS.model_copy(update=off), DT)
    assert Machine(p).trips_after(**signals()) == 0


@pytest.mark.parametrize(("cause", "signals", "ticks"), CAUSES)
@pytest.mark.parametrize(("later", "more", "_ticks"), CAUSES)
def test_first_cause_is_latched(cause: int, signals: dict, ticks: int, later: int, more: dict, _ticks: int) -> None:
    machine = Machine()
    machine.trips_after(**signals)
    at = int(machine.s["trip_tick"])
    for _ in range(20):
        machine.tick(**more)
    assert (machine.s["state"], machine.s["trip"], machine.s["trip_tick"]) == (TRIPPED, cause, at)


def test_only_reset_leaves_the_tripped_state() -> None:
    machine = Machine()
    machine.trips_after(error=9.0)
    for request in ({"arm": 1}, {"disarm": 1}, {"arm": 1, "disarm": 1}, {}):
        assert machine.tick(**request) == 0.0
        assert machine.s["state"] == TRIPPED and machine.s["trip"] == FOLLOWING
    assert machine.tick(reset=1) == 0.0
    assert machine.s["state"] == IDLE and machine.s["trip"] == NONE
    assert machine.tick() == 0.0  # requests before the reset are dropped
    assert machine.s["state"] == IDLE


def test_reset_and_arm_in_one_tick_restart() -> None:
    machine = Machine()
    machine.trips_after(error=9.0)
    assert machine.tick(reset=1, arm=1) == 3.0
    assert machine.s["state"] == ARMED and machine.s["on"] == 1
    machine.tick()
    assert machine.s["on"] == 0 and machine.s["armed_for"] == 2


def test_reset_without_a_trip_does_nothing() -> None:
    machine = Machine()
    assert machine.tick(reset=1) == 3.0 and machine.s["state"] == RUNNING
    machine.trips_after(error=9.0)
    machine.tick()
    assert machine.s["state"] == TRIPPED  # the old request is consumed


@pytest.mark.parametrize("state", [ARMED, RUNNING])
def test_disarm_switches_the_outputs_off_at_once(state: int) -> None:
    machine = Machine(state=state)
    assert machine.tick(disarm=1) == 0.0 and machine.s["state"] == IDLE and machine.s["trip"] == NONE


def test_disarm_overrides_an_earlier_arm_and_arm_while_running_does_nothing() -> None:
    machine = Machine()
    assert machine.tick(arm=1) == 3.0 and machine.s["state"] == RUNNING and machine.s["on"] == 0


def test_trip_with_a_ramp_fades_the_outputs_in_its_time() -> None:
    machine = Machine(safety.build(SETTINGS.model_copy(update={"ramp": 0.01}), DT))
    machine.tick(u=-4.0)
    left = [machine.tick(u=9.0, error=9.0) for _ in range(15)]
    assert left == pytest.approx([*(-4.0 * (1 - n / 10) for n in range(1, 10)), *[0.0] * 6], abs=1e-12)
    assert left[10:] == [0.0] * 5
    assert machine.tick(u=9.0, reset=1) == 0.0


def test_nan_command_is_never_written() -> None:
    machine = Machine()
    assert machine.tick(u=np.nan) == 0.0


@settings(deadline=None)
@given(
    st.lists(
        st.fixed_dictionaries(
            {},
            optional={
                "arm": st.integers(0, 1), "disarm": st.integers(0, 1), "reset": st.integers(0, 1),
                "error": st.sampled_from([0.0, 0.6, np.nan]), "fresh": st.integers(0, 1), "lost": st.integers(0, 1),
            },
        ),
        max_size=40,
    )
)  # fmt: skip
def test_outputs_are_on_only_in_states_armed_and_running(events: list[dict]) -> None:
    machine = Machine(state=IDLE)
    for event in events:
        was = int(machine.s["state"])
        u = machine.tick(**event)
        now = int(machine.s["state"])
        assert (u != 0.0) == (now in (ARMED, RUNNING))
        assert (machine.s["trip"] != NONE) == (now == TRIPPED)
        assert not (was == TRIPPED and now != TRIPPED and not event.get("reset"))
        assert not (was == IDLE and now != IDLE and not event.get("arm"))


TIMED = [c for c in CAUSES if c[2] > 2]


@pytest.mark.parametrize(("cause", "signals", "ticks"), TIMED)
def test_limits_count_clock_periods_not_ticks(cause: int, signals: dict, ticks: int) -> None:
    """Half of the ticks are missed: the limit is reached after an equal number of periods, in half of the ticks."""
    machine = Machine()
    assert machine.trips_after(**{**signals, "passed": 2}) == (ticks + 1) // 2
    assert machine.s["trip"] == cause


@pytest.mark.parametrize(("cause", "signals", "ticks"), TIMED)
def test_stall_as_long_as_the_limit_trips_in_its_tick(cause: int, signals: dict, ticks: int) -> None:
    assert Machine().trips_after(**{**signals, "passed": 1000}) == 1


def test_stall_below_the_limit_or_while_off_does_not_trip() -> None:
    machine = Machine()
    assert machine.tick(late=1, passed=6) == 3.0
    machine = Machine(state=IDLE)
    assert machine.tick(arm=1, late=1, passed=1000) == 3.0 and machine.s["armed_for"] == 1


def test_trip_ramp_counts_clock_periods() -> None:
    machine = Machine(safety.build(SETTINGS.model_copy(update={"ramp": 0.01}), DT))
    machine.tick(u=4.0)
    assert machine.tick(error=9.0) == pytest.approx(3.6)
    assert machine.tick(passed=4) == pytest.approx(2.0)


def test_board_watchdog_events_before_arming_do_not_trip() -> None:
    s, rx, tx = np.zeros(1, safety.SAFETY_STATE)[0], np.zeros(1, frames.INPUTS)[0], np.zeros(1, frames.OUTPUTS)[0]
    s["state"], tx["seq"] = safety.TRIPPED, 70
    assert safety.board_watchdog(s, rx, tx) == 0
    s["state"], tx["seq"] = safety.ARMED, 71
    rx["watchdog"], rx["watchdog_seq"] = 1, 68  # the report arrives late, after an interrupted link
    assert safety.board_watchdog(s, rx, tx) == 0
    rx["watchdog"], rx["watchdog_seq"] = 2, 71
    assert [safety.board_watchdog(s, rx, tx) for _ in range(2)] == [1, 1]


def test_board_watchdog_trips_at_each_count_while_on() -> None:
    machine = Machine(state=IDLE)
    machine.tick(watchdog=3)
    machine.tick(watchdog=3, arm=1)
    assert machine.tick(watchdog=3) == 3.0
    assert machine.tick(watchdog=4) == 0.0 and machine.s["trip"] == WATCHDOG
    machine.tick(watchdog=5, reset=1, arm=1)
    assert machine.s["state"] == TRIPPED  # the watchdog acted in the tick of arming


def test_silence_of_commander_and_of_supervisor_are_separate_causes() -> None:
    p = safety.build(SafetySettings(require_commander=True, commander_timeout=1.0, supervisor_timeout=2.0), DT)
    at = 10**12
    assert safety.gone(p, at, at - 10**9, at - 2 * 10**9) == NONE
    assert safety.gone(p, at, at - 10**9 - 1, at) == COMMANDER
    assert safety.gone(p, at, at, at - 2 * 10**9 - 1) == SUPERVISOR
    assert safety.gone(p, at, 0, 0) == NONE  # a loop without a supervisor
    free = safety.build(SafetySettings(supervisor_timeout=0.0), DT)
    assert safety.gone(free, at, 1, 1) == NONE


def test_every_trip_cause_has_a_code_and_a_sentence() -> None:
    assert sorted(safety.TRIPS) == list(range(len(safety.TRIPS)))
    codes = [code for code, _ in safety.TRIPS.values()]
    assert len(set(codes)) == len(codes) and all(why for _, why in safety.TRIPS.values())


def test_empty_tension_range_is_refused() -> None:
    with pytest.raises(ValueError, match="tension_min 5 N is not below tension_max 5 N"):
        safety.build(SafetySettings(tension_min=5.0, tension_max=5.0), DT)


def test_trip_in_the_tick_of_arming_does_not_fade_old_outputs():
    machine = Machine(P._replace(fade=0.1))
    assert machine.tick(u=9.0) == 9.0
    machine.tick(lost=1, u=9.0)
    assert machine.s["state"] == TRIPPED
    for _ in range(20):
        machine.tick()
    assert machine.tick(reset=1) == 0.0
    assert machine.tick(arm=1, lost=1, u=9.0) == 0.0 and machine.s["state"] == TRIPPED
