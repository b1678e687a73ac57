"""A machine is recorded, diagnosed, and where that leaves two answers recorded once more."""

import json
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from narrowed import only

from rtctl.case.format1 import read_case
from rtctl.cli.common import load_config
from rtctl.cli.main import main
from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import set_path
from rtctl.diagnose.answer import played, repair
from rtctl.diagnose.answer.files import write
from rtctl.diagnose.answer.format1_config import to_config
from rtctl.diagnose.answer.motions import MENU, Limits
from rtctl.diagnose.model.by_symbol import Model, owner_model
from rtctl.diagnose.record.format1 import Record, load_record
from rtctl.laws import reference
from rtctl.machines import CONFIGS
from rtctl.machines.profiles import PROFILES
from rtctl.plants.physics import TERMS

STEP = {"at": 0.5, "to": 0.02}
SPRING = {"term": "load.spring", "node": "carriage", "k": 800.0}
EXPERIMENT = {
    "words": "Crawl to and fro.",
    "why": {"words": "It separates drive.lag from timing.delay."},
    "reference": {"unit": "m", "knots": [[0.0, 0.0], [0.5, np.float64(0.02)]], "repeat": 2.0, "relative": True},
    "excitation": None,
    "seconds": 7.0,
}


def found(verdict, experiment=None, names=("drive.lag", "timing.delay")):
    """As much of a diagnosis as a repair looks at."""
    effects = tuple(SimpleNamespace(name=name) for name in names)
    return SimpleNamespace(verdict=verdict, experiment=experiment, effects=effects)


class Bench:
    """A machine that notes what it is made to do, and a chain that answers as it is told."""

    def __init__(self, *answers, trips=()):
        self.answers, self.trips = list(answers), list(trips)
        self.played, self.said = [], []

    def record(self, config, bundle, seconds):
        self.played.append((config.reference, bundle.name, seconds))
        return {"tripped": self.trips.pop(0) if self.trips else None}

    def diagnose(self, *bundles, progress):
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def repair(self, config, tmp_path, length=None):
        return repair.repair(config, tmp_path, length, self.said.append, self.record, self.diagnose)


@pytest.fixture
def axis(config):
    return repair.ready(config("axis"))


def test_one_recording_where_it_is_clear(axis, tmp_path):
    bench = Bench(found("named"))
    made = bench.repair(axis, tmp_path)
    assert [name for _, name, _ in bench.played] == ["recording"]
    assert bench.played[0][2] == PROFILES["axis"].duty.recording
    assert made.last.verdict == "named" and made.bundle == tmp_path / "recording"


def test_the_experiment_where_two_answers_are_left(axis, tmp_path):
    bench = Bench(found("ambiguous", EXPERIMENT), found("named"))
    made = bench.repair(axis, tmp_path, 12.0)
    (first, _, length), (second, name, seconds) = bench.played
    assert (length, name, seconds) == (12.0, "experiment", 7.0)
    assert first == axis.reference
    assert second.knots[1] == (0.5, 0.02) and second.repeat == 2.0
    assert made.last.verdict == "named" and made.bundle == tmp_path / "experiment"
    assert any("drive.lag or timing.delay" in text for text in bench.said)


@pytest.mark.parametrize("verdict", ["ambiguous", "nothing", "unnamed"])
def test_no_experiment_without_a_plan(axis, tmp_path, verdict):
    bench = Bench(found(verdict))
    assert bench.repair(axis, tmp_path).last.verdict == verdict
    assert len(bench.played) == 1


def test_an_experiment_that_fails_takes_nothing_away(axis, tmp_path):
    bench = Bench(found("ambiguous", EXPERIMENT), NoAnswer("nothing moved"))
    made = bench.repair(axis, tmp_path)
    assert made.last.verdict == "ambiguous" and made.bundle == tmp_path / "recording"
    assert len(made.bundles) == 2
    assert any("nothing moved" in text for text in bench.said)


def test_a_trip_in_the_experiment(axis, tmp_path):
    bench = Bench(found("ambiguous", EXPERIMENT), found("nothing"), trips=(None, "following_error"))
    made = bench.repair(axis, tmp_path)
    assert made.last.verdict == "ambiguous"
    assert made.trips == ("", "following_error")


def test_a_first_recording_that_supports_no_verdict(axis, tmp_path):
    with pytest.raises(NoAnswer):
        Bench(NoAnswer("too short")).repair(axis, tmp_path)


@pytest.mark.parametrize("kind", ["ivu", "ldu", "axis"])
def test_an_emulated_machine_has_something_to_do(config, kind):
    ready = repair.ready(config(kind, mode="real"))
    assert ready.loop.mode == "fused"
    assert ready.reference.repeat <= PROFILES[kind].duty.recording + 0.001
    steps = ready.reference.steps
    assert steps[-1].to == 0.0 and all(a.at < b.at for a, b in pairwise(steps))


def test_its_own_reference_and_mode_are_left_alone(config):
    ready = repair.ready(set_path(config("axis", mode="lockstep"), "reference", {"steps": [STEP]}), "lockstep")
    assert ready.loop.mode == "lockstep" and len(ready.reference.steps) == 1


def test_a_machine_that_is_not_ours_is_not_moved_unasked(config):
    external = set_path(config("axis", mode="real", link="zmq"), "link.plant", "external")
    with pytest.raises(UserError, match="--reference"):
        repair.ready(external)
    told = repair.ready(set_path(external, "reference", {"steps": [STEP]}))
    assert told.loop.mode == "real"


def small(before, after, experiment=None):
    """A diagnosis with models only, of an axis that anybody recorded."""
    case = read_case({"plant": "axis", "sample_rate": 1000.0, "parameters": before.base, "controller": None}, ".")
    t = np.arange(2000) * 1e-3
    record = Record("axis", case, t, 1e-3, t * np.nan, 0 * t, np.zeros((2000, 1)), {"x": t}, {})
    return SimpleNamespace(owner=before, after=after, record=record, experiment=experiment)


def text(d, own=None):
    """The file of its experiment."""
    data = to_config(d.owner, d.record) if own is None else own
    return played.text(data, d.experiment, ["drive.lag", "timing.delay"], 2.0, own is not None)


AXIS = Model("axis", {"M": 95.0, "K": 35.0, "F_v": 200.0, "F_c": 20.0, "k": 0.0})


def test_what_the_experiment_file_holds():
    file = text(small(AXIS, AXIS, EXPERIMENT))
    head = "".join(line for line in file.splitlines() if line.startswith("#"))
    assert any("`rtctl run experiment.yaml --for 7s`" in line for line in file.splitlines())  # in one line, to copy
    assert "Crawl" in head and "drive.lag from timing.delay" in head and "--for 7s" in head
    assert "stands in for the recorded" in head
    assert "\n  - [0.5, 0.02]\n" in file  # a knot a line
    settings = CONFIGS["axis"].model_validate(yaml.safe_load(file))
    assert settings.reference.knots[1] == (0.5, 0.02)
    assert settings.plant.parameters.M == 95.0
    assert settings.loop.mode == "fused"  # a stand-in needs no clock


def test_the_head_says_how_much_room_it_needs_and_what_else_was_tried():
    plan = {**EXPERIMENT, "limits": {"travel": [-0.02, 0.05]}}
    plan["why"] = {
        "words": "To tell.",
        "distance": {"dither": 0.2, "slow_ramp": 3.0},
        "refused": {"warm_up": "too far"},
    }
    head = [line for line in text(small(AXIS, AXIS, plan)).splitlines() if line.startswith("#")]
    assert "with room of -20 to 50 mm around it" in " ".join(head)
    assert [line.split()[1] for line in head if line.startswith("#     ")] == ["slow_ramp", "dither", "warm_up"]


@pytest.mark.parametrize("make", MENU)
def test_every_motion_is_played_from_the_file_as_it_is(tmp_path, make):
    limits = Limits("m", "V", 1e-3, -0.02, 0.05, 0.1, 1.0, 1e-6, 8.0)
    motion = make(limits, 1.0)
    plan = {"reference": {"unit": "m", "knots": motion.knots, "repeat": motion.repeat, "relative": True}}
    path = tmp_path / "experiment.yaml"
    path.write_text(text(small(AXIS, AXIS, {**plan, "seconds": motion.seconds})))
    settings = load_config(str(path), [])
    params = reference.build(settings.reference, 1e-3)
    state, setpoint = np.zeros(1, reference.REFERENCE_STATE), np.zeros(1, reference.SETPOINT)
    reference.start(params, state[0], 0)
    n = round(min(motion.seconds, 20.0) * 1000)
    played = np.array([reference.step(params, state[0], setpoint[0], k) for k in range(n)])
    assert np.abs(played - motion.reference(np.arange(n) * 1e-3)).max() < 1e-3 * np.ptp(played)
    knots = path.read_text().partition("knots:\n")[2].partition("\n  repeat")[0].partition("\n  relative")[0]
    assert all(line.startswith("  - [") for line in knots.splitlines())


def test_the_file_is_run_as_it_is(runtime, tmp_path):
    path = tmp_path / "experiment.yaml"
    path.write_text(text(small(AXIS, AXIS, EXPERIMENT)))
    assert main(["run", str(path), "--for", "3s", "--out", str(tmp_path / "run")]) == 0
    again = load_record(tmp_path / "run")
    assert np.ptp(again.ref) == pytest.approx(0.02, rel=0.01)


def test_the_experiment_on_our_own_machine_is_its_config(config):
    own = config("axis", set={"law.limit.high": 6.0}).model_dump(mode="json", exclude_unset=True)
    file = text(small(AXIS, AXIS, EXPERIMENT), own)
    settings = CONFIGS["axis"].model_validate(yaml.safe_load(file))
    assert "stands in for the recorded" not in file
    assert settings.law.limit.high == 6.0 and settings.name == own["name"]


@given(M=st.floats(1.0, 1e3), k=st.floats(1.0, 1e4))
def test_changes_are_those_of_the_model(M, k):
    spring = TERMS["load.spring"].settings(**{**SPRING, "k": k})
    rows = repair.between(AXIS, AXIS.change(M=M).add(spring))
    keys = [key for key, _, _ in rows]
    assert ("plant.parameters.M" in keys) == (abs(M - 95.0) > 1e-4 * max(M, 95.0))
    assert keys[-1] == "plant.physics.0" and "load.spring at carriage" in rows[-1][2]
    assert repair.between(AXIS, AXIS) == []


def test_a_spring_on_an_emulated_axis_is_found_and_added(runtime, config, tmp_path, monkeypatch):
    only(monkeypatch, "load.spring", "friction.coulomb", "drive.offset")
    machine = repair.ready(config("axis", set={"plant.physics": [SPRING]}))
    made = repair.repair(machine, tmp_path, 9.0)
    record = load_record(made.bundle)
    assert np.ptp(record.columns["state"]) == 0  # rows on the way there are left out
    assert record.y["x"] - record.columns["x"] == pytest.approx(0.5e-6)  # the middle of what a count stands for
    assert owner_model(record.case).terms == ()  # the recording does not say what is hidden
    assert "load.spring" in {e.name for e in made.last.effects}, made.last.effects
    assert write(made.last, tmp_path, report=False) == []
    written = yaml.safe_load((tmp_path / "model.yaml").read_text())
    spring = next(entry for entry in written["plant"]["physics"] if entry["term"] == "load.spring")
    assert spring["k"] == pytest.approx(800.0, rel=0.1)
    assert written["law"] == json.loads((made.bundle / "case.json").read_text())["config"]["law"]
    assert CONFIGS["axis"].model_validate(written).loop.mode == "fused"
