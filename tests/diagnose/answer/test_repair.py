"""Repair: recording, diagnosis, and a second recording after an ambiguous verdict."""

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


def mock_diagnosis(verdict, experiment=None, names=("drive.lag", "timing.delay")):
    """Mock diagnosis with the attributes that a repair uses."""
    effects = tuple(SimpleNamespace(name=name) for name in names)
    return SimpleNamespace(verdict=verdict, experiment=experiment, effects=effects)


class Bench:
    """Mock machine that logs its motions, and mock diagnosis with given answers."""

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


def test_named_verdict_needs_one_recording(axis, tmp_path):
    bench = Bench(mock_diagnosis("named"))
    made = bench.repair(axis, tmp_path)
    assert [name for _, name, _ in bench.played] == ["recording"]
    assert bench.played[0][2] == PROFILES["axis"].duty.recording
    assert made.last.verdict == "named" and made.bundle == tmp_path / "recording"


def test_ambiguous_verdict_runs_the_experiment(axis, tmp_path):
    bench = Bench(mock_diagnosis("ambiguous", EXPERIMENT), mock_diagnosis("named"))
    made = bench.repair(axis, tmp_path, 12.0)
    (first, _, length), (second, name, seconds) = bench.played
    assert (length, name, seconds) == (12.0, "experiment", 7.0)
    assert first == axis.reference
    assert second.knots[1] == (0.5, 0.02) and second.repeat == 2.0
    assert made.last.verdict == "named" and made.bundle == tmp_path / "experiment"
    assert any("drive.lag or timing.delay" in words for words in bench.said)


@pytest.mark.parametrize("verdict", ["ambiguous", "nothing", "unnamed"])
def test_verdict_without_a_plan_runs_no_experiment(axis, tmp_path, verdict):
    bench = Bench(mock_diagnosis(verdict))
    assert bench.repair(axis, tmp_path).last.verdict == verdict
    assert len(bench.played) == 1


def test_failed_experiment_keeps_the_first_verdict(axis, tmp_path):
    bench = Bench(mock_diagnosis("ambiguous", EXPERIMENT), NoAnswer("nothing moved"))
    made = bench.repair(axis, tmp_path)
    assert made.last.verdict == "ambiguous" and made.bundle == tmp_path / "recording"
    assert len(made.bundles) == 2
    assert any("nothing moved" in words for words in bench.said)


def test_tripped_experiment_keeps_the_first_verdict(axis, tmp_path):
    bench = Bench(mock_diagnosis("ambiguous", EXPERIMENT), mock_diagnosis("nothing"), trips=(None, "following_error"))
    made = bench.repair(axis, tmp_path)
    assert made.last.verdict == "ambiguous"
    assert made.trips == ("", "following_error")


def test_first_recording_without_a_verdict_has_no_answer(axis, tmp_path):
    with pytest.raises(NoAnswer):
        Bench(NoAnswer("too short")).repair(axis, tmp_path)


@pytest.mark.parametrize("kind", ["ivu", "ldu", "axis"])
def test_emulated_machine_gets_a_default_reference(config, kind):
    ready = repair.ready(config(kind, mode="real"))
    assert ready.loop.mode == "fused"
    assert ready.reference.repeat <= PROFILES[kind].duty.recording + 0.001
    steps = ready.reference.steps
    assert steps[-1].to == 0.0 and all(a.at < b.at for a, b in pairwise(steps))


def test_configured_reference_and_given_mode_are_kept(config):
    ready = repair.ready(set_path(config("axis", mode="lockstep"), "reference", {"steps": [STEP]}), "lockstep")
    assert ready.loop.mode == "lockstep" and len(ready.reference.steps) == 1


def test_external_machine_needs_an_explicit_reference(config):
    external = set_path(config("axis", mode="real", link="zmq"), "link.plant", "external")
    with pytest.raises(UserError, match="--reference"):
        repair.ready(external)
    told = repair.ready(set_path(external, "reference", {"steps": [STEP]}))
    assert told.loop.mode == "real"


def diagnosis_with_models(before, after, experiment=None):
    """Mock diagnosis of a foreign axis recording, with models only."""
    case = read_case({"plant": "axis", "sample_rate": 1000.0, "parameters": before.base, "controller": None}, ".")
    t = np.arange(2000) * 1e-3
    record = Record("axis", case, t, 1e-3, t * np.nan, 0 * t, np.zeros((2000, 1)), {"x": t}, {})
    return SimpleNamespace(owner=before, after=after, record=record, experiment=experiment)


def experiment_text(d, own=None):
    """Text of the experiment file."""
    data = to_config(d.owner, d.record) if own is None else own
    return played.text(data, d.experiment, ["drive.lag", "timing.delay"], 2.0, own is not None)


AXIS = Model("axis", {"M": 95.0, "K": 35.0, "F_v": 200.0, "F_c": 20.0, "k": 0.0})


def test_experiment_file_has_instructions_and_a_valid_config():
    file = experiment_text(diagnosis_with_models(AXIS, AXIS, EXPERIMENT))
    head = "".join(line for line in file.splitlines() if line.startswith("#"))
    assert any("`rtctl run experiment.yaml --for 7s`" in line for line in file.splitlines())  # one line to copy
    assert "Crawl" in head and "drive.lag from timing.delay" in head and "--for 7s" in head
    assert "stands in for the recorded" in head
    assert "\n  - [0.5, 0.02]\n" in file  # one knot per line
    settings = CONFIGS["axis"].model_validate(yaml.safe_load(file))
    assert settings.reference.knots[1] == (0.5, 0.02)
    assert settings.plant.parameters.M == 95.0
    assert settings.loop.mode == "fused"  # a stand-in needs no real-time clock


def test_experiment_header_has_the_travel_and_the_alternatives():
    plan = {**EXPERIMENT, "limits": {"travel": [-0.02, 0.05]}}
    plan["why"] = {
        "words": "To tell.",
        "distance": {"dither": 0.2, "slow_ramp": 3.0},
        "refused": {"warm_up": "too far"},
    }
    head = [
        line for line in experiment_text(diagnosis_with_models(AXIS, AXIS, plan)).splitlines() if line.startswith("#")
    ]
    assert "with room of -20 to 50 mm around it" in " ".join(head)
    assert [line.split()[1] for line in head if line.startswith("#     ")] == ["slow_ramp", "dither", "warm_up"]


@pytest.mark.parametrize("make", MENU)
def test_every_motion_is_reproduced_from_the_experiment_file(tmp_path, make):
    limits = Limits("m", "V", 1e-3, -0.02, 0.05, 0.1, 1.0, 1e-6, 8.0)
    motion = make(limits, 1.0)
    plan = {"reference": {"unit": "m", "knots": motion.knots, "repeat": motion.repeat, "relative": True}}
    path = tmp_path / "experiment.yaml"
    path.write_text(experiment_text(diagnosis_with_models(AXIS, AXIS, {**plan, "seconds": motion.seconds})))
    settings = load_config(str(path), [])
    params = reference.build(settings.reference, 1e-3)
    state, setpoint = np.zeros(1, reference.REFERENCE_STATE), np.zeros(1, reference.SETPOINT)
    reference.start(params, state[0], 0)
    n = round(min(motion.seconds, 20.0) * 1000)
    played = np.array([reference.step(params, state[0], setpoint[0], k) for k in range(n)])
    assert np.abs(played - motion.reference(np.arange(n) * 1e-3)).max() < 1e-3 * np.ptp(played)
    knots = path.read_text().partition("knots:\n")[2].partition("\n  repeat")[0].partition("\n  relative")[0]
    assert all(line.startswith("  - [") for line in knots.splitlines())


def test_experiment_file_runs_without_changes(runtime, tmp_path):
    path = tmp_path / "experiment.yaml"
    path.write_text(experiment_text(diagnosis_with_models(AXIS, AXIS, EXPERIMENT)))
    assert main(["run", str(path), "--for", "3s", "--out", str(tmp_path / "run")]) == 0
    again = load_record(tmp_path / "run")
    assert np.ptp(again.ref) == pytest.approx(0.02, rel=0.01)


def test_experiment_of_a_recorded_config_is_the_config(config):
    own = config("axis", set={"law.limit.high": 6.0}).model_dump(mode="json", exclude_unset=True)
    file = experiment_text(diagnosis_with_models(AXIS, AXIS, EXPERIMENT), own)
    settings = CONFIGS["axis"].model_validate(yaml.safe_load(file))
    assert "stands in for the recorded" not in file
    assert settings.law.limit.high == 6.0 and settings.name == own["name"]


@given(M=st.floats(1.0, 1e3), k=st.floats(1.0, 1e4))
def test_listed_changes_are_the_differences_of_the_models(M, k):
    spring = TERMS["load.spring"].settings(**{**SPRING, "k": k})
    rows = repair.between(AXIS, AXIS.change(M=M).add(spring))
    keys = [key for key, _, _ in rows]
    assert ("plant.parameters.M" in keys) == (abs(M - 95.0) > 1e-4 * max(M, 95.0))
    assert keys[-1] == "plant.physics.0" and "load.spring at carriage" in rows[-1][2]
    assert repair.between(AXIS, AXIS) == []


@pytest.mark.long
def test_repair_finds_a_spring_of_an_emulated_axis(runtime, config, tmp_path, monkeypatch):
    only(monkeypatch, "load.spring", "friction.coulomb", "drive.offset")
    machine = repair.ready(config("axis", set={"plant.physics": [SPRING]}))
    made = repair.repair(machine, tmp_path, 9.0)
    record = load_record(made.bundle)
    assert np.ptp(record.columns["state"]) == 0  # only rows of the running state
    assert record.y["x"] - record.columns["x"] == pytest.approx(0.5e-6)  # the middle of a count
    assert owner_model(record.case).terms == ()  # the recording hides the concealed term
    assert "load.spring" in {e.name for e in made.last.effects}, made.last.effects
    assert write(made.last, tmp_path, report=False) == []
    written = yaml.safe_load((tmp_path / "model.yaml").read_text())
    spring = next(entry for entry in written["plant"]["physics"] if entry["term"] == "load.spring")
    assert spring["k"] == pytest.approx(800.0, rel=0.1)
    assert written["law"] == json.loads((made.bundle / "case.json").read_text())["config"]["law"]
    assert CONFIGS["axis"].model_validate(written).loop.mode == "fused"
