"""User law on a user plant of the reel unit: run, change of a gain, failure, replay."""

import numpy as np
import pytest
from rtctl_config import TEMPLATES, loaded

from rtctl.config.errors import UserError
from rtctl.config.load import set_path
from rtctl.daemon.case import describe
from rtctl.loop import generate
from rtctl.loop.replay import Replay
from rtctl.tick import safety

POSITION = {"kind": "./try.py:Try", "gain": 20, "tau_d": "0.1 s"}
NOT_A_NUMBER, INFINITE, RAISES, RAISES_IN_RESET = 1, 2, 3, 4
LAW = '''"""A PD that fails when it is told to."""
from typing import NamedTuple

import numpy as np

from rtctl.idiom import quantity, state, tick
from rtctl.laws import pd


class TrySettings(pd.PdSettings):
    fail: int = quantity(0, unit="", ge=0, le=4, help="how")


class TryParams(NamedTuple):
    pd: pd.PdParams
    fail: int


TRY_STATE = state(pd=pd.PD_STATE, n=int)


def build(settings, dt):
    return TryParams(pd.build(settings, dt), settings.fail)


@tick
def step(p, s, e):
    s.n += 1
    if p.fail == 3:
        raise ValueError("told to")
    if p.fail == 1:
        return np.nan
    return pd.step(p.pd, s.pd, e) if p.fail != 2 else np.inf


@tick
def reset(p, s):
    if p.fail == 4:
        raise RuntimeError("told to")
    pd.reset(p.pd, s.pd)
'''


@pytest.fixture
def own(config_file):
    files = {"try.py": LAW, "my_plant.py": (TEMPLATES / "my_plant_ivu.py").read_text()}
    file = config_file("ivu", files, position=POSITION, plant="./my_plant.py:MyPlant")
    return loaded(file, "reference={steps: [{at: 0.2, to: 1.0}]}", "record.trace=[position.n]", "law.inertia.share=0")


@pytest.fixture
def running(own, bench):
    """A bench that has run for two seconds, and its rows."""
    made = bench(own)
    rows = made.ask("arm", "play").run(2.0)
    assert (rows["trip"] == 0).all() and rows["state"][-1] == safety.RUNNING
    made.rows = rows
    return made


def test_user_law_follows_the_reference_and_its_state_is_recorded(running):
    rows = running.rows
    assert rows["target"][-1] - rows["target"][0] == pytest.approx(1.0)
    assert abs(rows["capstan_error"][-1]) < 0.1
    assert rows["position_n"][-1] == len(rows)
    assert rows["truth_capstan"][-1] == pytest.approx(rows["capstan"][-1], abs=2e-3)
    assert np.isnan(rows["truth_tension1"]).all()  # the plant has no state T1


@pytest.mark.parametrize("how", [NOT_A_NUMBER, INFINITE, RAISES])
def test_failing_law_trips_with_zero_outputs(running, own, how):
    running.take_over(set_path(own, "law.position.fail", how))
    rows = running.ask("gains").run(0.1)
    assert rows["trip"][0] == safety.NOT_A_NUMBER
    assert not rows["u1"].any() and not rows["u2"].any()
    running.take_over(own)
    rows = running.ask("gains", "reset", "arm").run(2.0)
    assert rows["state"][-1] == safety.RUNNING and (rows["trip"] == 0).all()


def test_law_that_fails_at_arming_trips(running, own):
    running.take_over(set_path(own, "law.position.fail", RAISES_IN_RESET))
    running.ask("gains", "disarm").run(0.1)
    rows = running.ask("arm").run(0.1)
    assert (rows["trip"] == safety.NOT_A_NUMBER).all()
    assert not rows["u1"].any() and not rows["u2"].any()


def test_output_limit_applies_after_the_law(bench, own):
    made = bench(set_path(set_path(own, "law.position.gain", 1e4), "law.limit.high", 1.5))
    rows = made.ask("arm", "play").run(2.0)
    assert np.abs(rows["u_c"]).max() > 10.0
    assert max(np.abs(rows["u1"]).max(), np.abs(rows["u2"]).max()) <= 1.505


def test_user_law_replays_bit_exact(running):
    replayed = Replay(running.machine)
    replayed.c["arm"] = replayed.c["play"] = replayed.c["order"] = 1
    again = replayed.over(running.rows)
    for name in ("u1", "u2", "u_c", "position_n"):
        assert (again[name].view(np.int64) == running.rows[name].view(np.int64)).all()


def test_recording_marks_a_user_law_as_outside_the_format(running):
    case = describe(running.machine, running.made)
    assert case["controller"]["kind"] == "unknown" and case["controller_known"] is False
    assert case["config"]["own"]["./try.py"] == LAW
    assert "./my_plant.py:MyPlant" in case["notes"] and case["parameters"] == {}


def test_invalid_law_is_refused_before_the_tick_is_compiled(config_file, law):
    from rtctl import machines

    text = law("a = np.zeros(3)\n    return a[0] + e")
    config = loaded(config_file("ivu", {"try.py": text}, position={"kind": "./try.py:Try", "gain": 1}))
    for _ in range(2):
        with pytest.raises(UserError, match="takes memory in every tick"):
            generate.generate(machines.build(config), "shm")
