"""Closed loop of our own recordings by the tick of their config: with an own law, and with another plant."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from rtctl import api
from rtctl.config.errors import NoAnswer, UserError
from rtctl.diagnose.emulate import can_emulate, emulate
from rtctl.diagnose.kernel import CLOSED, OPEN
from rtctl.diagnose.measure import compare, default_mode
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.record import INPUT, load_record
from rtctl.own import files, model
from rtctl.own.files import give
from rtctl.trace.bundle import load_bundle

ROOT = Path(__file__).parents[2]
STEPS = [{"at": 0.2, "to": 0.02, "ramp": 0.2}, {"at": 1.6, "to": 0.0, "ramp": 0.2}]


@pytest.fixture(scope="module")
def own(config, tmp_path_factory) -> Path:
    """A recording of the axis under a law of the user's own; the law lies beside it."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "my_law.py").write_text((ROOT / "rtctl/own/templates/my_law.py").read_text())
    settings = yaml.safe_load((ROOT / "configs/axis.yaml").read_text())
    settings["law"]["position"] = {"kind": "./my_law.py:MyLaw", "gain": 8000.0, "tau_d": 0.02}
    settings |= {"name": config("axis").name, "reference": {"steps": STEPS}}
    (folder / "own.yaml").write_text(yaml.safe_dump(settings))
    api.record(api.load_config(folder / "own.yaml", {"loop.mode": "fused"}), 2.5, folder / "run")
    return folder


@pytest.fixture
def foreign(monkeypatch):
    """This process has read no own file."""
    monkeypatch.setattr(files, "_trusted", set())
    model._model.cache_clear()
    model._law.cache_clear()


def test_without_the_file_the_recorded_command_is_the_input(own, foreign):
    bundle, record = load_bundle(own / "run"), load_record(own / "run")
    assert default_mode(record, bundle) == OPEN
    said = next(warning for warning in record.case.warnings if INPUT in warning)
    assert "a position law of an own file, ./my_law.py:MyLaw" in said and "--own ./my_law.py" in said
    with pytest.raises(UserError, match="own file"):
        compare(record, owner_model(record.case), CLOSED, 0, bundle)
    with pytest.raises(UserError, match="--own"):
        emulate(bundle, record, owner_model(record.case))


def test_with_the_file_the_loop_is_closed_to_the_bit(own, foreign):
    give([own / "my_law.py"])
    bundle, record = load_bundle(own / "run"), load_record(own / "run")
    assert not record.closed_loop and default_mode(record, bundle) == CLOSED
    found = compare(record, owner_model(record.case), None, 0, bundle)
    assert found.mode == CLOSED and set(found.channels) == {"x", "u"}
    for channel in found.channels.values():
        np.testing.assert_array_equal(channel.simulated, channel.recorded)
    assert np.ptp(found.channels["u"].recorded) > 0.5


def test_another_plant_gives_another_command(own, foreign):
    give([own / "my_law.py"])
    bundle, record = load_bundle(own / "run"), load_record(own / "run")
    nominal = owner_model(record.case)
    heavier = compare(record, nominal.change(M=1.2 * nominal.base["M"]), CLOSED, 0, bundle)
    assert 1e-4 < heavier.channels["x"].nrmse < 0.1
    assert heavier.channels["u"].nrmse > 0.01


def test_a_model_that_trips_the_machine_is_no_answer(own, foreign):
    give([own / "my_law.py"])
    bundle, record = load_bundle(own / "run"), load_record(own / "run")
    nominal = owner_model(record.case)
    with pytest.raises(NoAnswer, match="trips the machine at tick"):
        emulate(bundle, record, nominal.change(K=1e-3))


def test_only_a_whole_recording_of_our_own_is_emulated(own):
    bundle = load_bundle(own / "run")
    assert can_emulate(bundle)
    assert not can_emulate(bundle._replace(case={**bundle.case, "config": None}))
    late = {name: values[3:] for name, values in bundle.columns.items()}
    assert not can_emulate(bundle._replace(columns=late))
    assert not can_emulate(bundle._replace(columns={k: v for k, v in bundle.columns.items() if k != "order"}))
