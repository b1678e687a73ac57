from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl import machines
from rtctl.case.format1 import read_case
from rtctl.config.errors import UserError
from rtctl.config.load import load_settings
from rtctl.diagnose.answer.format1_config import read_model, to_config, write_model, write_turn
from rtctl.diagnose.answer.torque_ripple_map import Turn
from rtctl.diagnose.model.by_symbol import owner_model
from rtctl.diagnose.record.format1 import Record, load_record
from rtctl.plants.physics import TERMS

SHARED = Path(__file__).parents[3].parent / "shared"
CASES = {
    "ivu": {
        "plant": "ivu",
        "sample_rate": 500.0,
        "parameters": {"R1": 0.035, "R2": 0.028, "J_m1": 0.00151234567, "tau_F1": 0.0024, "J_1": 1.33458e-4},
        "sensors": {"capstan_counts_per_rev": 10000, "reel_counts_per_rev": 209},
        "drive": {"amp_per_volt": [0.2, 0.2], "limit_volt": 10.0, "dac_bits": 12},
        "delay_samples": 1.0,
        "controller": {"kind": "pd", "P": 4.3, "D": 0.7, "derivative_filter_hz": 80.0, "allocation": "motor1"},
    },
    "ldu": {
        "plant": "ldu",
        "sample_rate": 10000.0,
        "parameters": {"R_c": 0.003, "M": 2.5, "N": 20.0, "F_c": 5.0},
        "sensors": {"encoder_counts_per_rev": 20000, "scale_m_per_count": 5e-7},
        "drive": {"amp_per_volt": [0.1], "limit_volt": 3.0, "dac_bits": 12, "bandwidth_hz": 1500.0, "damping": 0.7},
        "delay_samples": 1.0,
        "controller": {"kind": "lead_lag", "sections": [[2000.0, -1900.0, 0.0, -0.5, 0.0]]},
    },
    "axis": {
        "plant": "axis",
        "sample_rate": 1000.0,
        "parameters": {"M": 95.0, "F_v": 203.456789},
        "drive": {"newton_per_volt": 35.0, "limit_volt": 10.0},
        "sensors": {"x_resolution_m": 5e-8},
        "controller": {"kind": "cascade_p_v", "kp": 160.0, "kv": 243.0},
    },
}
TERM_OF = {
    "ivu": {"term": "friction.stribeck", "node": "motor1", "F_s": 0.004123456789, "v_s": 0.3},
    "ldu": {"term": "ripple.encoder", "node": "encoder", "A": 1.23456789e-3, "phi": -1.5},
    "axis": {"term": "load.bump", "node": "carriage", "F": 12.0, "at": 0.1, "width": 0.01, "form": "push"},
}


def record_of(kind, **changes):
    case = read_case({**CASES[kind], **changes}, ".")
    dt = 1.0 / (case.sample_rate or 1000.0)
    zero = np.zeros(1000)
    return Record(kind, case, np.arange(1000) * dt, dt, zero, zero, np.zeros((1000, 1)), {}, {})


def model_of(record):
    """Nominal model with one term, as from a fit."""
    entry = TERM_OF[record.plant]
    fields = TERMS[entry["term"]].settings.model_fields.items()
    defaults = {n: f.get_default() for n, f in fields if not f.is_required()}
    return owner_model(record.case).add(TERMS[entry["term"]].settings.model_construct(**{**defaults, **entry}))


@pytest.mark.parametrize("kind", CASES)
def test_model_file_round_trip(kind, tmp_path):
    record = record_of(kind)
    model = model_of(record)
    back = read_model(write_model(model, record, tmp_path / "model.yaml"), record)
    assert back.kind == kind
    assert back.base.keys() == model.base.keys()
    for name, value in model.base.items():
        assert back.base[name] == pytest.approx(value, rel=1e-5), name
    assert len(back.terms) == 1
    for name in type(back.terms[0]).model_fields:
        mine, theirs = getattr(back.terms[0], name), getattr(model.terms[0], name)
        assert mine == (pytest.approx(theirs, rel=1e-5) if isinstance(theirs, float) else theirs)


@pytest.mark.parametrize("kind", CASES)
def test_model_file_is_a_valid_config(kind, tmp_path):
    record = record_of(kind)
    path = write_model(model_of(record), record, tmp_path / "model.yaml")
    config = load_settings(path, machines.CONFIGS[kind])
    machine = machines.build(config)
    assert machine.rate == record.case.sample_rate
    assert config.law.limit.high == record.case.drive.limit_volt
    assert [t.term for t in config.plant.physics] == [TERM_OF[kind]["term"]]


@pytest.mark.parametrize("kind", CASES)
def test_model_config_has_six_digits_and_no_defaults(kind):
    record = record_of(kind)
    plant = to_config(model_of(record), record)["plant"]
    assert plant["physics"][0].keys() == TERM_OF[kind].keys()
    for value in [*plant["parameters"].values(), *plant["physics"][0].values()]:
        if isinstance(value, float):
            assert value == float(f"{value:.6g}")


def test_recorded_config_changes_only_in_the_plant():
    record = record_of("axis")
    own = {
        "name": "bench",
        "machine": "axis",
        "loop": {"rate": 1000.0},
        "law": {"position": {"kind": "pd", "gain": 3.0}},
        "plant": {"rate": 2000.0, "parameters": {"M": 1.0}, "physics": [{"term": "load.spring"}]},
    }
    made = to_config(model_of(record), record, own)
    assert {k: v for k, v in made.items() if k != "plant"} == {k: v for k, v in own.items() if k != "plant"}
    assert made["plant"]["rate"] == 2000.0
    assert made["plant"]["parameters"]["M"] == 95.0
    assert [entry["term"] for entry in made["plant"]["physics"]] == ["load.bump"]
    assert own["plant"]["parameters"] == {"M": 1.0}  # the argument is unchanged


def test_nominal_gear_ratio_is_kept(tmp_path):
    record = record_of("ldu", parameters={"N": 19.0})  # and R_t / R_s is 20
    back = read_model(write_model(owner_model(record.case), record, tmp_path / "m.yaml"), record)
    assert back.base["N"] == pytest.approx(19.0, rel=1e-5)


@pytest.mark.parametrize(
    ("kind", "changes", "words"),
    [
        ("axis", {"sensors": {"unit": "rad", "x_counts_per_rev": 8192}}, "read rad for m"),
        ("axis", {"sample_rate": None}, "uneven clock"),
        ("axis", {"controller": {"kind": "unknown"}}, "the owner's law, 'unknown'"),
        ("ivu", {"delay_samples": 1.4}, "the delay, 1.4 samples"),
        ("ivu", {"drive": {"amp_per_volt": [0.2, 0.3]}}, "the gain of drive 2, 0.3 A/V"),
        ("ldu", {"drive": {"amp_per_volt": [0.3]}}, "the gain of the amplifier, 0.3 A/V"),
        ("ldu", {"sensors": {"encoder_counts_per_rev": 20000.5, "scale_m_per_count": 5e-7}}, "20000.5 counts a turn"),
    ],
)
def test_header_lists_what_could_not_be_translated(kind, changes, words, tmp_path):
    record = record_of(kind, **changes)
    path = write_model(owner_model(record.case), record, tmp_path / "m.yaml")
    head = "".join(line[1:] for line in path.read_text().splitlines() if line.startswith("#"))
    assert words in head
    assert yaml.safe_load(path.read_text())["machine"] == kind


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"M": -1.0}, "parameters: M: -1.0 kg is out of bounds"),
        ({"F_v": float("inf")}, "parameters: F_v"),
    ],
)
def test_parameters_out_of_bounds_are_refused(change, message, tmp_path):
    record = record_of("axis")
    with pytest.raises(UserError, match=message):
        write_model(owner_model(record.case).change(**change), record, tmp_path / "m.yaml")
    assert not (tmp_path / "m.yaml").exists()


def test_terms_out_of_bounds_are_refused(tmp_path):
    record = record_of("axis")
    viscous = TERMS["friction.viscous"].settings
    for values, message in (
        ({"node": "carriage", "B": 2e5}, "friction.viscous at carriage: B: 200000.0 is out of bounds"),
        ({"node": "carriage", "B": float("nan")}, "B: nan is not finite"),
        ({"node": "carrage", "B": 1.0}, "did you mean 'carriage'"),
    ):
        model = owner_model(record.case).add(viscous.model_construct(term="friction.viscous", **values))
        with pytest.raises(UserError, match=message):
            write_model(model, record, tmp_path / "m.yaml")


def test_model_without_a_mass_is_refused(tmp_path):
    record = record_of("axis", parameters={})
    with pytest.raises(UserError, match="lacks M"):
        write_model(owner_model(record.case), record, tmp_path / "m.yaml")


def test_missing_folder_is_reported(tmp_path):
    record = record_of("axis")
    with pytest.raises(UserError, match="cannot be written: No such file"):
        write_model(owner_model(record.case), record, tmp_path / "no" / "m.yaml")


def test_model_of_another_machine_is_refused(tmp_path):
    record = record_of("axis")
    with pytest.raises(UserError, match="machine is ivu, and the bundle was recorded on the axis"):
        read_model("ivu", record)
    (tmp_path / "x.yaml").write_text("machine: lathe\n")
    with pytest.raises(UserError, match="machine is 'lathe'; it should be axis"):
        read_model(tmp_path / "x.yaml", record)


def test_shipped_config_is_read_as_a_model():
    model = read_model("ivu", record_of("ivu"))
    assert (model.base["R1"], model.base["d_tape"], model.terms) == (0.038, 0.5e-3, ())
    assert model.base["J_1"] > 0


@given(
    M=st.floats(1e-6, 1e4),
    K=st.floats(1e-6, 1e4),
    F=st.floats(-1e3, 1e3).filter(lambda x: abs(x) > 1e-9),
)
@settings(deadline=None, max_examples=30)
def test_axis_model_round_trip_for_any_values(tmp_path_factory, M, K, F):
    record = record_of("axis")
    spring = TERMS["load.spring"].settings.model_construct(term="load.spring", node="carriage", k=F, x0=0.0)
    model = owner_model(record.case).change(M=M, K=K).add(spring)
    back = read_model(write_model(model, record, tmp_path_factory.mktemp("m") / "m.yaml"), record)
    assert (back.base["M"], back.base["K"], back.terms[0].k) == pytest.approx((M, K, F), rel=1e-5)


@pytest.mark.parametrize("name", ["blind/practice/case-0001", "blind/practice/case-0004", "data/emps"])
def test_model_round_trip_of_foreign_recordings(name, tmp_path):
    if not (SHARED / name).is_dir():
        pytest.skip("needs the recordings in ../shared")
    record = load_record(SHARED / name)
    model = owner_model(record.case)
    back = read_model(write_model(model, record, tmp_path / "m.yaml"), record)
    assert back.base == pytest.approx(model.base, rel=1e-5)


def test_torque_ripple_map_is_written_as_a_table(tmp_path):
    angle = np.array([0.5, 1.5, 2.5])
    found = Turn(angle, np.array([1e-3, np.nan, -2e-3]), np.array([1e-4, np.nan, 2e-4]), np.array([4, 0, 5]), (), 5.0)
    path = write_turn(found, tmp_path / "torque_over_turn.csv")
    lines = path.read_text().splitlines()
    assert lines[0] == "angle_rad,torque_Nm,band_Nm,visits"
    assert lines[1:] == ["0.500000,0.001,0.0001,4", "1.500000,,,0", "2.500000,-0.002,0.0002,5"]
    with pytest.raises(UserError, match="cannot be written"):
        write_turn(found, tmp_path / "nowhere" / "x.csv")
