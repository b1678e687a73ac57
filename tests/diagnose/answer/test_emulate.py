"""Closed-loop emulation of recordings of the program: with user code as law, and with another plant."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from rtctl import api
from rtctl.case.laws import INPUT
from rtctl.config.errors import NoAnswer, UserError
from rtctl.diagnose.answer.emulate import can_emulate, emulate
from rtctl.diagnose.answer.freerun import compare
from rtctl.diagnose.answer.load import of_bundle
from rtctl.diagnose.model.by_symbol import owner_model
from rtctl.diagnose.model.format1 import graph_record
from rtctl.own import files, model
from rtctl.own.files import give
from rtctl.trace.bundle import load_bundle

ROOT = Path(__file__).parents[3]
STEPS = [{"at": 0.2, "to": 0.02, "ramp": 0.2}, {"at": 1.6, "to": 0.0, "ramp": 0.2}]


@pytest.fixture(scope="module")
def own(config, tmp_path_factory) -> Path:
    """Folder with a recording of the axis under a user law and the file of the law."""
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
    """Process state without a trusted user file."""
    monkeypatch.setattr(files, "_trusted", set())
    model._model.cache_clear()
    model._law.cache_clear()


def test_recording_with_an_untrusted_law_runs_in_open_loop(own, foreign):
    bundle = load_bundle(own / "run")
    record = of_bundle(bundle)
    assert not compare(record, bundle=bundle).closed
    said = next(warning for warning in record.case.warnings if INPUT in warning)
    assert "a position law of an own file, ./my_law.py:MyLaw" in said and "--own ./my_law.py" in said
    with pytest.raises(UserError, match="own file"):
        compare(record, True, 0, bundle)
    with pytest.raises(UserError, match="--own"):
        emulate(bundle, record)


def test_trusted_user_law_reproduces_the_recording_bit_for_bit(own, foreign):
    give([own / "my_law.py"])
    bundle = load_bundle(own / "run")
    record = of_bundle(bundle)
    assert not record.source.closed_loop
    found = compare(record, bundle=bundle)
    assert found.closed and set(found.channels) == {"x", "u"}
    for channel in found.channels.values():
        np.testing.assert_array_equal(channel.simulated, channel.recorded)
    assert np.ptp(found.channels["u"].recorded) > 0.5


def with_values(record, **changes):
    """The record with changed nominal parameters."""
    return graph_record(record.source, owner_model(record.source.case).change(**changes))


def test_heavier_plant_changes_the_emulated_command(own, foreign):
    give([own / "my_law.py"])
    bundle = load_bundle(own / "run")
    record = of_bundle(bundle)
    heavier = compare(with_values(record, M=1.2 * record.case.values["bodies.carriage.mass"]), True, 0, bundle)
    assert 1e-4 < heavier.channels["x"].nrmse < 0.1
    assert heavier.channels["u"].nrmse > 0.01


def test_model_that_trips_the_machine_has_no_answer(own, foreign):
    give([own / "my_law.py"])
    bundle = load_bundle(own / "run")
    with pytest.raises(NoAnswer, match="trips the machine at tick"):
        emulate(bundle, with_values(of_bundle(bundle), K=1e-3))


def test_emulation_of_a_described_machine_reproduces_the_recording(config, tmp_path):
    changes = {"name": config("axis").name, "loop.mode": "fused"}
    bundle = api.record(api.load_config("machines/belt", changes), 1.5, tmp_path / "run")
    record = of_bundle(bundle)
    found = compare(record, bundle=bundle)
    assert found.closed and set(found.channels) == {*record.y, *record.case.machine.drives}
    for channel in found.channels.values():
        np.testing.assert_array_equal(channel.simulated, channel.recorded)
    machine = record.case.machine.model_dump(mode="json", exclude_unset=True)
    (tmp_path / "heavy.yaml").write_text(yaml.safe_dump({"machine": heavier(machine)}))
    other = compare(of_bundle(bundle, tmp_path / "heavy.yaml"), bundle=bundle)
    assert other.closed and 1e-6 < other.channels["encoder"].nrmse < 0.5


def heavier(machine):
    """Description with twice the mass or inertia of its first body."""
    name, body = next((n, b) for n, b in machine["bodies"].items() if "mass" in b or "inertia" in b)
    key = "mass" if "mass" in body else "inertia"
    return {**machine, "bodies": {**machine["bodies"], name: {**body, key: 2.0 * body[key]}}}


def test_only_complete_recordings_of_the_program_are_emulated(own):
    bundle = load_bundle(own / "run")
    assert can_emulate(bundle)
    assert not can_emulate(replace(bundle, case={**bundle.case, "config": None}))
    late = {name: values[3:] for name, values in bundle.columns.items()}
    assert not can_emulate(replace(bundle, columns=late))
    assert not can_emulate(replace(bundle, columns={k: v for k, v in bundle.columns.items() if k != "order"}))
