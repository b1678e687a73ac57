import pytest
import yaml
from graph_cases import BELT, RUB, blank, case_of, command, named

from rtctl.case.start import is_start
from rtctl.config.errors import UserError
from rtctl.diagnose.answer.config import to_config, write_model
from rtctl.diagnose.model.model import nominal, settings_of
from rtctl.plants.graph.file import read_machine


def fitted():
    """Record, and a model with changed parameters and a term."""
    record = blank(case_of(BELT), command(0.6, 1.0))
    model = nominal(record.case)
    base = {**model.base, "bodies.carriage.mass": 1.62345678, "joints.belt.stiffness": 38123.4567}
    return record, model._replace(base=base).add(settings_of(RUB))


def test_model_file_round_trip(tmp_path):
    record, model = fitted()
    read = read_machine(write_model(model, record, tmp_path / "model.yaml"))
    assert read.machine.bodies["carriage"].mass == 1.62346  # six figures
    assert read.machine.joints["belt"].stiffness == 38123.5
    assert dict(read.machine.paths()).keys() == {path for path in record.case.values if not is_start(path)}
    unchanged = {path: v for path, v in read.machine.paths() if model.base[path] == record.case.values[path]}
    assert unchanged == {path: record.case.values[path] for path in unchanged}
    assert read.physics == (RUB,)
    assert read.case == {"delay_samples": 1.0}


def test_model_file_has_units_and_lists_the_changes(tmp_path):
    record, model = fitted()
    text = write_model(model, record, tmp_path / "model.yaml").read_text()
    assert "mass: 1.62346 kg" in text
    assert "stiffness: 38123.5 N/m" in text
    assert "#   bodies.carriage.mass: 1.5 -> 1.623 kg" in text
    assert "#   bodies.motor" not in text
    data = yaml.safe_load(text)
    assert data["loop"] == {"rate": 500.0, "write": "next_tick"}


def test_model_config_keeps_the_other_settings_of_the_config():
    record, model = fitted()
    own = {"name": "bench", "machine": BELT, "plant": {"substep": 1e-3, "physics": []}, "law": {"feedback": "scale"}}
    data = to_config(model, record, own)
    assert data["name"] == "bench"
    assert data["law"] == {"feedback": "scale"}
    assert data["plant"] == {"substep": 1e-3, "physics": [RUB]}


def test_model_file_omits_an_unknown_unit(tmp_path):
    machine = {**BELT, "drives": {"amplifier": {**BELT["drives"]["amplifier"], "unit": "LSB"}}}
    record = blank(case_of(machine), command(0.6, 1.0))
    path = write_model(nominal(record.case), record, tmp_path / "model.yaml")
    assert read_machine(path).machine.drives["amplifier"].gain == 0.25


def test_model_file_of_a_diagnosis_contains_the_found_effect(tmp_path):
    d = named()
    read = read_machine(write_model(d.decided.best.model, d.record, tmp_path / "model.yaml"))
    assert [(e["term"], e["node"]) for e in read.physics] == [("friction.coulomb", "carriage")]


def test_unwritable_path_is_reported(tmp_path):
    record, model = fitted()
    with pytest.raises(UserError, match="cannot be written"):
        write_model(model, record, tmp_path / "none" / "model.yaml")
