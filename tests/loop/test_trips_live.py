"""Trips of a whole machine, caused through its config: tick of the trip, and outputs off from that tick."""

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl.daemon.session import Session
from rtctl.daemon.supervisor import Supervisor
from rtctl.tick.safety import (
    COMMANDER,
    CURRENT,
    FOLLOWING,
    FROZEN,
    MISSED,
    NOT_A_NUMBER,
    START_UP,
    TENSION,
    TRIPS,
)
from rtctl.trace.bundle import load_bundle

STEPS = {"steps": [{"at": 0.1, "to": 1.0}]}
STUCK = {"plant.parameters": {"R1": 0.038, "R2": 0.022, "tau_F1": 9.0, "tau_F2": 9.0, "tau_Fc": 9.0}}
NO_LIMIT = {"safety.following_error": 0.0, "safety.current_time": 0.0, "safety.frozen_time": 0.0}


def limits(**keys: float) -> dict[str, Any]:
    return {**NO_LIMIT, "reference": STEPS, **{f"safety.{name}": value for name, value in keys.items()}}


def over_ticks(condition: np.ndarray, k: int) -> int:
    """Number of consecutive ticks before tick `k` at which a condition held."""
    before = condition[:k][::-1]
    return int(np.argmin(before)) if not before.all() else len(before)


def check_off(rows: np.ndarray, k: int, cause: int) -> None:
    """Assert outputs on before tick `k` and off from tick `k`, with this cause only."""
    assert (rows["state"][k:] == 3).all() and (rows["trip"][k:] == cause).all()
    assert (rows["state"][:k] != 3).all() and not rows["trip"][:k].any()
    assert not rows["u1"][k:].any() and not rows["u2"][k:].any()


def check_restart(made: Any, seconds: float = 0.2) -> np.ndarray:
    """Assert that reset leads to idle and rearming starts without a jump of the outputs."""
    idle = made.ask("reset").run(0.05)
    assert (idle["state"] == 0).all() and not idle["u1"].any() and not idle["trip"].any()
    rows = made.ask("arm").run(seconds)
    assert rows["state"][0] == 1
    u = np.concatenate([idle[["u1", "u2"]][-1:], rows[["u1", "u2"]]])
    assert max(abs(u[n][0]).max() for n in ("u1", "u2")) == 0.0
    first = max(abs(rows["u1"][0]), abs(rows["u2"][0]))
    assert first < 0.05, f"{first} V in the first tick"
    assert abs(rows["capstan_error"][0]) < 1e-9
    return rows


@pytest.fixture
def tripped(config: Callable[..., Any], bench: Callable[..., Any]) -> Callable[..., tuple[Any, np.ndarray, int]]:
    """Arm, play, and run; returns the bench, its rows and the tick of the trip."""

    def run(keys: dict[str, Any], seconds: float = 3.0) -> tuple[Any, np.ndarray, int]:
        made = bench(config(set=keys))
        rows = made.ask("arm", "play").run(seconds)
        assert made.status["trip"], "no trip"
        return made, rows, int(made.status["trip_tick"])

    return run


def test_following_error_trips(tripped: Callable[..., Any]) -> None:
    made, rows, k = tripped(limits(following_error=0.002))
    check_off(rows, k, FOLLOWING)
    assert abs(rows["capstan_error"][k]) > 0.002
    assert np.abs(rows["capstan_error"][:k]).max() <= 0.002
    check_restart(made, 0.002)


def test_frozen_encoder_trips(tripped: Callable[..., Any]) -> None:
    made, rows, k = tripped({**limits(frozen_time=0.05, frozen_effort=2.0), **STUCK})
    check_off(rows, k, FROZEN)
    still = np.concatenate([[False], np.diff(rows["capstan_counts"]) == 0]) & (np.abs(rows["u_c"]) > 2.0)
    assert over_ticks(still, k + 1) == 26  # 25 are allowed
    check_restart(made)


def test_tension_out_of_range_trips(tripped: Callable[..., Any]) -> None:
    made, rows, k = tripped(limits(tension_min=-0.2, tension_max=0.2, tension_time=0.01))
    check_off(rows, k, TENSION)
    T = np.array([rows["tension1_estimate"], rows["tension2_estimate"]])
    out = ((T < -0.2) | (T > 0.2)).any(axis=0) & (np.concatenate([[0], rows["state"][:-1]]) == 2)
    assert over_ticks(out, k + 1) == 6
    check_restart(made)


def test_sustained_overcurrent_trips(tripped: Callable[..., Any]) -> None:
    made, rows, k = tripped({**limits(current=0.3, current_time=0.04), **STUCK})
    check_off(rows, k, CURRENT)
    amperes = np.maximum(np.abs(rows["u1"]), np.abs(rows["u2"])) * 0.2
    assert over_ticks(amperes > 0.3, k) == 20  # with the tick of the trip, whose outputs are off
    check_restart(made)


def test_nan_in_the_tick_trips(tripped: Callable[..., Any]) -> None:
    _, rows, k = tripped({**limits(), "law.position.gain": 1e306})
    check_off(rows, k, NOT_A_NUMBER)
    assert np.isfinite(rows["u1"]).all() and np.isfinite(rows["u2"]).all()


def test_failed_radius_measurement_at_start_up_trips(tripped: Callable[..., Any]) -> None:
    small = {"R_min": 0.005, "R_max": 0.010}
    made, rows, k = tripped({**limits(), "radius.source": "measured", "radius.measure": small}, 30.0)
    check_off(rows, k, START_UP)
    assert set(rows["state"][:k]) == {1}
    check_restart(made)


def test_lost_commander_trips(config: Callable[..., Any], bench: Callable[..., Any]) -> None:
    made = bench(config(set=limits()))
    assert made.ask("arm", "play").run(1.0)["state"][-1] == 2
    rows = made.ask(commander_lost=1).run(0.1)
    check_off(rows, 0, COMMANDER)
    assert made.ask("reset").run(0.01)["state"][0] == 0
    made.ask("arm").run(0.002)
    assert made.status["trip"] == COMMANDER  # still no commander
    made.ask(commander_lost=0)
    check_restart(made)


def test_trip_with_a_ramp_takes_the_outputs_down_without_a_jump(tripped: Callable[..., Any]) -> None:
    _, rows, k = tripped({**limits(following_error=0.02, ramp=0.1), **STUCK})
    u = rows["u1"][k - 1 : k + 60]
    assert u[0] > 0.1 and (np.diff(u) <= 0.0).all() and np.abs(np.diff(u)).max() < 0.05 * u[0]
    assert not rows["u1"][k + 50 :].any()


@pytest.fixture
def live(runtime: Path, config: Callable[..., Any], tmp_path: Path) -> Callable[..., tuple[dict, dict]]:
    """A run in separate processes; returns result and trace."""

    def run(mode: str, link: str, length: float, keys: dict[str, Any]) -> tuple[dict, dict]:
        made = Session(config(mode=mode, link=link, set=keys), tmp_path / "bundle", length)
        return made.run(), load_bundle(tmp_path / "bundle").columns

    return run


def test_trip_is_reported_with_code_tick_and_sentence(live: Callable[..., Any]) -> None:
    result, trace = live("lockstep", "shm", 1.5, limits(following_error=0.002))
    assert result["tripped"] == "following_error" and result["state"] == "tripped"
    k = result["trip"]["tick"]
    assert result["trip"]["why"] == TRIPS[FOLLOWING][1]
    assert trace["state"][k] == 3 and trace["state"][k - 1] != 3 and not trace["u1"][k:].any()


@pytest.mark.realtime
def test_consecutive_late_ticks_trip(live: Callable[..., Any]) -> None:
    result, trace = live("real", "shm", 1.0, {**limits(missed_ticks=5), "loop.late": 1e-9})
    assert result["tripped"] == "missed_ticks" and result["trip"]["tick"] == 4  # every tick is late at this threshold
    assert not trace["u1"][4:].any() and (trace["trip"][4:] == MISSED).all()


@pytest.mark.realtime
def test_missing_commander_trips_in_real_mode(live: Callable[..., Any]) -> None:
    keys = {"safety.require_commander": True, "safety.commander_timeout": 0.3, "safety.link_timeout": 5.0}
    result, trace = live("real", "shm", 1.5, keys)
    assert result["tripped"] == "commander_lost"
    k = result["trip"]["tick"]
    assert not trace["u1"][k:].any() and (trace["state"][:k] != 3).all()


@pytest.mark.realtime
@pytest.mark.parametrize("link", ["zmq", "shm"])
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_lost_plant_trips(
    runtime: Path, config: Callable[..., Any], tmp_path: Path, link: str, how: signal.Signals
) -> None:
    keys = {"safety.link_timeout": 0.5, "safety.missed_ticks": 0}  # long: no trip on a busy test machine
    supervisor = Supervisor(config(mode="real", link=link, set=keys), tmp_path / "bundle", 1000)
    supervisor.armed_at_start = True
    gone = 0
    with supervisor:
        for _ in supervisor.run():
            if not gone and int(supervisor.status["tick"]) > 300:
                assert supervisor.plant is not None
                os.kill(supervisor.plant.pid, how)
                gone = int(supervisor.status["tick"])
        if how == signal.SIGSTOP and supervisor.plant is not None:
            os.kill(supervisor.plant.pid, signal.SIGCONT)
        result = supervisor.snapshot()
        supervisor.finish()
    assert result["trip"] is not None and result["trip"]["code"] == "link_lost"
    trace = load_bundle(tmp_path / "bundle").columns
    k = result["trip"]["tick"]
    assert trace["link_age"][k] == 251 and gone <= k
    assert not trace["u1"][k:].any() and not trace["u2"][k:].any() and trace["u1"][k - 1] > 0
