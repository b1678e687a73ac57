import json

import numpy as np
import pytest
from typer.testing import CliRunner

from rtctl.cli.main import app
from rtctl.config.errors import UserError
from rtctl.plants.graph.file import read_machine
from rtctl.trace.bundle import load_bundle
from rtctl.trace.imports import read
from rtctl.trace.imports.described import make_described
from rtctl.trace.imports.plan import Plan, with_options

BELT = """\
bodies:
  motor: {inertia: 0.4 kg*cm^2, dry: 4 mNm}
  carriage: {mass: 1500 g, dry: 2 N}
joints:
  belt: {from: motor, to: carriage, ratio: 12.7 mm/rad, stiffness: 40 N/mm, damping: 25 N*s/m}
drives:
  amplifier: {body: motor, column: u, kind: force, gain: 250 mNm/V}
sensors:
  encoder: {body: motor, measures: position, column: encoder_counts, counts_per_unit: 8000 counts/turn}
  scale: {body: carriage, measures: position, column: scale_mm, per_unit: 1000, resolution: 0.005}
"""
CONFIG = (
    "machine:\n"
    + "".join(f"  {line}\n" for line in BELT.splitlines())
    + """\
tolerance: {default: 0.1, joints.belt.ratio: 0}
physics:
  - {term: friction.viscous, node: carriage, B: 3}
"""
)
T = np.arange(100) / 500.0
TURN = 2 * np.pi * np.sin(T)


@pytest.fixture
def bench(tmp_path):
    """`bench(columns, maps, description)` writes a log and a machine description and imports them."""

    def make(columns, maps=(), text=BELT, units=(), case=(), **more):
        log, machine = tmp_path / "log.csv", tmp_path / "belt.yaml"
        rows = zip(*columns.values(), strict=True)
        log.write_text("\n".join([",".join(columns), *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n")
        machine.write_text(text)
        plan = with_options(Plan(), None, list(maps), list(units), None, [], list(case), False)
        made = make_described(read(log), plan.model_copy(update=more), read_machine(machine), tmp_path / "bench")
        return made, load_bundle(tmp_path / "bench")

    return make


def columns(**more):
    return {"time": T, "volts": np.cos(T), "pos": np.round(8000 * np.sin(T)), **more}


MAPS = ["t=time,u=volts,encoder_counts=pos"]


def test_import_with_a_description_makes_a_bundle_of_format_2(bench):
    made, bundle = bench(columns(), MAPS)
    assert made.rate == 500.0
    assert bundle.case["format"] == 2
    assert bundle.case["machine"]["bodies"]["motor"] == {"inertia": 4e-5, "dry": 4e-3}
    assert bundle.case["tolerance"] == {"default": 0.15}
    np.testing.assert_array_equal(bundle.columns["encoder_counts"], np.round(8000 * np.sin(T)))
    assert "scale" not in bundle.case["machine"]["sensors"]
    assert any("no column of sensor scale" in note for note in made.notes)


def test_tolerance_and_physics_of_a_config_are_kept(bench):
    _, bundle = bench(columns(), MAPS, CONFIG, case=["tolerance.bodies.motor.dry=0.5"])
    assert bundle.case["tolerance"] == {"default": 0.1, "joints.belt.ratio": 0, "bodies.motor.dry": 0.5}
    assert bundle.case["physics"] == [{"term": "friction.viscous", "node": "carriage", "B": 3.0}]


def test_drive_and_sensor_names_can_replace_column_names(bench):
    _, bundle = bench(columns(), ["t=time,amplifier=volts,encoder=pos"])
    assert set(bundle.columns) == {"t", "u", "encoder_counts"}


def test_log_units_are_converted_to_those_of_the_description(bench):
    log = columns(pos=np.round(8000 * np.sin(T)) * 360 / 8000, way=0.0127 * TURN, volts=1000 * np.cos(T))
    made, bundle = bench(log, [*MAPS, "scale_mm=way"], units=["encoder_counts=deg", "scale=m", "u=mV"])
    np.testing.assert_allclose(bundle.columns["encoder_counts"], np.round(8000 * np.sin(T)), atol=0)
    np.testing.assert_allclose(bundle.columns["scale_mm"], 12.7 * TURN, rtol=1e-6)
    np.testing.assert_allclose(bundle.columns["u"], np.cos(T), rtol=1e-6)
    assert any("deg made counts" in note for note in made.notes)


@pytest.mark.parametrize(
    ("log", "maps", "units", "sentence"),
    [
        (
            {},
            ["t=time,encoder_counts=pos"],
            [],
            "no column is 'u' of drive amplifier; name it with --map u=NAME, one of volts",
        ),
        (
            {},
            ["t=time,u=volts"],
            [],
            "no column is 'encoder_counts' of sensor encoder; name it with --map encoder_counts=NAME",
        ),
        ({}, ["t=time,u=volts,encodr_counts=pos"], [], "no column 'encodr_counts'; did you mean 'encoder_counts'?"),
        ({}, ["t=time,u=volt,encoder_counts=pos"], [], "has no column 'volt'"),
        ({"pos": 100 * TURN}, MAPS, [], "is not a whole number"),
        ({"pos": TURN + 1e-4}, MAPS, ["encoder_counts=rad"], "which is not whole; of a reading that is not counts"),
        ({}, MAPS, ["u=Nm"], "(drive amplifier) is in 'Nm', which is not V; --unit u=... says what it is"),
        ({"way_cm": 1.27 * TURN}, [*MAPS, "scale=way_cm"], [], "its name ends in cm, where the description has mm"),
        ({"pos_deg": np.round(TURN)}, ["t=time,u=volts,encoder=pos_deg"], [], "--unit encoder_counts=deg if it is deg"),
    ],
)
def test_invalid_import_is_refused(bench, tmp_path, log, maps, units, sentence):
    with pytest.raises(UserError) as error:
        bench(columns(**log), maps, units=units)
    assert sentence in str(error.value)
    assert not (tmp_path / "bench").exists()


def test_plant_name_is_not_a_description(bench):
    with pytest.raises(UserError, match="--plant goes without --machine"):
        bench(columns(), MAPS, plant="axis")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            BELT.replace("body: motor, column", "body: moter, column"),
            "belt.yaml:7: drives.amplifier.body: there is no body 'moter'; did you mean 'motor'?",
        ),
        (BELT.replace("40 N/mm", "40 N"), "belt.yaml"),
        ("name: belt\n", "machine is missing; a description has bodies, joints, drives and sensors"),
        ("machine: ivu\n", "belt.yaml:1: machine is 'ivu'; a description has bodies"),
        (CONFIG.replace("friction.viscous", "friction.viscos"), "there is no term 'friction.viscos'; did you mean"),
    ],
)
def test_invalid_description_error_names_file_and_line(bench, text, sentence):
    with pytest.raises(UserError) as error:
        bench(columns(), MAPS, text)
    assert sentence in str(error.value)


def test_import_command_with_a_machine_description(bench, tmp_path):
    bench(columns(), MAPS)
    log, machine, out = (str(tmp_path / name) for name in ("log.csv", "belt.yaml", "other"))
    done = CliRunner().invoke(app, ["import", log, "--machine", machine, "--map", MAPS[0], "-o", out, "--json"])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert told["rows"] == 100
    assert told["lacks"] is None


def test_note_on_assumed_units_lists_only_columns_with_a_unit(bench):
    text = BELT.replace("column: u, ", "column: u, enabled: power, ")
    made, _ = bench(columns(power=np.ones(100)), MAPS, text)
    assert next(note for note in made.notes if "assumed" in note).startswith("no unit is given: u in V assumed")


def test_empty_reference_is_not_imported(bench):
    _, bundle = bench(columns(ref=np.full(100, np.nan), w=np.zeros(100)), MAPS)
    assert set(bundle.columns) == {"t", "u", "encoder_counts", "w"}


def test_negative_scale_does_not_change_the_unit(bench):
    made, _ = bench(columns(way=-12.7 * TURN), [*MAPS, "scale_mm=way"], BELT.replace("1000,", "-1000,"))
    assert made.columns["scale_mm"] == "mm"
