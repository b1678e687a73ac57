"""Machines described in a config: every example runs with its starting law and its own names and units."""

from pathlib import Path
from typing import Any

import fused
import numpy as np
import pytest
from marks import long_where

from rtctl import machines
from rtctl.cli.common import load_config
from rtctl.config.errors import UserError
from rtctl.config.load import get_path, load_settings, set_path, to_yaml
from rtctl.loop import generate
from rtctl.machines import described
from rtctl.machines.described_plant import graph_of
from rtctl.plants.graph.played import played
from rtctl.tick import safety

COUPLED = {"cart-pole", "furuta"}  # equations of a file, which take long to compile
EXAMPLES = sorted(path.stem for path in (fused.CONFIGS / "machines").glob("*.yaml"))


def config(name: str, **changes: Any) -> Any:
    return fused.config(f"machines/{name}", **changes)


@pytest.fixture(scope="module")
def belt() -> fused.Run:
    return fused.run(config("belt"), 4.0)


def test_columns_have_the_names_and_units_of_the_description(belt):
    units = {c.name: c.unit for c in belt.loop.machine.diagram.columns}
    assert units["u"] == "V" and units["encoder_counts"] == units["scale_counts"] == "counts"
    assert (units["feedback"], units["speed"], units["u_c"]) == ("rad", "rad/s", "V")
    names = belt.rows.dtype.names
    assert {"truth_motor", "truth_motor_speed", "truth_carriage", "truth_carriage_speed"} <= set(names)


def test_belt_axis_follows_its_reference(belt):
    assert not belt.tripped and belt["state"][-1] == safety.RUNNING
    at = belt.between(1.8, 1.99)
    assert at["truth_motor"] == pytest.approx(12.0, abs=0.15)  # steady-state error by dry friction
    assert at["truth_carriage"] == pytest.approx(0.0127 * at["truth_motor"], abs=1e-4)


def test_counters_agree_with_the_motion_of_the_bodies(belt):
    assert np.abs(belt["encoder_counts"] - belt["truth_motor"] * 8000 / (2 * np.pi)).max() <= 1.0
    assert np.abs(belt["scale_counts"] - belt["truth_carriage"] * 1e5).max() <= 1.0
    assert np.allclose(belt["feedback"], belt["encoder_counts"] * 2 * np.pi / 8000)


def test_machines_of_the_same_structure_share_the_compiled_tick():
    """All numbers of a machine are parameters: another mass or stiffness does not recompile the tick."""
    one = machines.build(config("belt"))
    other = machines.build(
        config("belt", machine__bodies__carriage__mass="5 kg", machine__joints__belt__stiffness="200 N/mm")
    )
    assert generate.source(one, "shm") == generate.source(other, "shm")
    assert one.plant_diagram.blocks[0].params.inertia[1] == 1.4
    assert other.plant_diagram.blocks[0].params.inertia[1] == 5.0


def test_speed_sensor_makes_speed_the_feedback():
    settings = config("spindle")
    assert described.parts_of(settings).unit == "rad/s"
    assert settings.reference.steps[0].to == pytest.approx(1200 * 2 * np.pi / 60)
    run = fused.run(settings, 2.4)
    assert not run.tripped
    assert run.between(1.8, 1.9)["truth_motor_speed"] == pytest.approx(125.66, abs=0.5)
    tacho = run["rpm_read"] * 2 * np.pi / 60 - run["truth_motor_speed"]
    assert 0.02 < tacho[1000:].std() < 0.06  # 0.4 rpm of noise, in rad/s
    assert np.array_equal(run["feedback"], run["speed"])


def test_second_drive_gets_its_share_of_the_command():
    run = fused.run(config("two-motor", law__shares={"servo2": 0.5}), 1.4)
    moving = np.abs(run["amps1"]) > 0.5
    assert moving.sum() > 100
    assert run["amps2"][moving] == pytest.approx(0.5 * run["amps1"][moving], abs=2 * 8 / 2**15)


def test_drive_with_negative_gain_gets_a_negative_share():
    forward, backward = (machines.build(config("axis", machine__drives__drive__gain=g)) for g in (35.15, -35.15))
    shares = [next(b.params for b in m.diagram.blocks if b.name == "machine").shares[0] for m in (forward, backward)]
    assert shares == [1.0, -1.0]


def test_physics_term_can_act_at_any_body_but_not_at_a_spring():
    physics = [{"term": "friction.viscous", "node": "carriage", "B": 40.0}]
    free, held = (fused.run(config("belt", plant__physics=p), 1.2) for p in ([], physics))
    assert not held.tripped
    one, two = (run.between(0.8, 1.1)["u"].mean() for run in (free, held))  # at 15 rad/s, 0.19 m/s
    assert two - one == pytest.approx(40.0 * 0.1905 * 0.0127 / 0.03, rel=0.05)
    with pytest.raises(UserError, match=r"cannot stand at 'belt'; it can stand at motor, carriage"):
        config("belt", plant__physics=[{"term": "friction.viscous", "node": "belt", "B": 1.0}])


@pytest.mark.parametrize("name", long_where(COUPLED.__contains__, EXAMPLES))
def test_halving_the_integration_step_changes_less_than_a_tenth_of_a_count(name):
    """Three seconds of a smooth command to every drive, scaled to the demand of its reference."""
    settings = config(name)
    machine = machines.build(settings)
    n = round(3.0 * machine.rate)
    t = np.arange(n) * machine.dt
    wave = np.sin(2 * np.pi * 1.3 * t) * np.sin(np.pi * t / 3.0) ** 2
    u = np.stack([0.25 * (d.limit or 1.0) * wave for d in settings.machine.drives.values()], axis=1)
    shown = [
        played(graph_of(settings.machine, machine.dt / k)[2], u, k) for k in (machine.substeps, 2 * machine.substeps)
    ]
    for c, sensor in enumerate(settings.machine.sensors.values()):
        steps = np.abs(shown[0][:, c] - shown[1][:, c]).max() * abs(sensor.scale) / sensor.grain
        assert steps < 0.1, f"{name}: {steps:.2g} of a step of {sensor.column}"


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_is_stable_with_margins(name):
    from rtctl.design import margins

    settings = config(name)
    if ":" in settings.law.position.kind:
        pytest.skip("a law of its own has no model of its response")
    found = margins.of_config(settings, quick=True)
    assert found.stable and abs(found.GM) >= 6 and abs(found.PM) >= 45


@pytest.mark.parametrize("name", EXAMPLES)
def test_written_config_loads_unchanged(name, tmp_path):
    settings = config(name)
    path = tmp_path / "again.yaml"
    for full in (False, True):
        path.write_text(to_yaml(settings, full=full))
        assert load_config(str(path), []) == settings


def test_numbers_of_the_description_are_settings():
    settings = config("belt")
    assert get_path(settings, "machine.bodies.carriage.mass") == 1.4
    with pytest.raises(UserError, match="did you mean 'carriage'"):
        get_path(settings, "machine.bodies.carrige.mass")
    assert set_path(settings, "machine.bodies.carriage.mass", "2 kg").machine.bodies["carriage"].mass == 2.0


def test_law_gain_with_the_wrong_unit_is_refused(tmp_path: Path):
    with pytest.raises(UserError, match=r"belt.yaml:\d+: law.position.gain: '4.55 V/rad' is not a quantity in V/m"):
        config("belt", law__feedback="scale")


BAD = {
    "to: carriage, ratio": ("to: carrige, ratio", "joints.belt.to: there is no body 'carrige'; did you mean"),
    "{mass: 1.4 kg, dry: 3 N}": ("{dry: 3 N}", "carriage: give inertia .* or mass"),
    "ratio: 12.7 mm/rad": ("ratio: 12.7 mm", "machine.joints.belt.ratio: '12.7 mm' is not a quantity in m/rad"),
    "inertia: 0.21 kg*cm^2": ("inertia: 0.21 kg", "machine.bodies.motor.inertia: '0.21 kg' is not a quantity in kg"),
    "kind: force, gain: 30 mNm/V": (
        "kind: voltage, gain: 1 V/V, torque_constant: 0.1 Nm/A", "machine.drives.amplifier: resistance is missing",
    ),
    "column: encoder_counts": ("column: position_error", "column: 'position_error' is a signal of the loop itself"),
    "feedback: encoder": ("feedback: encodr", "law.feedback: there is no sensor .* 'encodr'; did you mean 'encoder'"),
}  # fmt: skip


@pytest.mark.parametrize("old", BAD)
def test_inconsistent_description_is_refused_with_file_and_line(old, tmp_path):
    text = (fused.CONFIGS / "machines" / "belt.yaml").read_text()
    new, words = BAD[old]
    path = tmp_path / "bad.yaml"
    path.write_text(text.replace(old, new, 1))
    line = 1 + text[: text.index(old)].count("\n")
    with pytest.raises(UserError, match=words) as refused:
        load_config(str(path), [])
    assert f"bad.yaml:{line}: " in str(refused.value)


LOOPS = {
    "an unobservable body": (
        "  joints:", "    idler: {inertia: 1e-5}\n  joints:", "machine.bodies.idler: no sensor sees it",
    ),
    "a loop of rigid joints": (
        "  drives:", "    rod: {from: motor, to: carriage, ratio: 0.0127}\n    bar: {from: motor, to: carriage, "
        "ratio: 0.0127}\n  drives:", "stiffness is missing: motor and carriage move as one already",
    ),
    "a rigid joint to the frame": (
        "  drives:", "    stop: {from: carriage, to: frame}\n  drives:", "rigid joint to the frame holds carriage",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", LOOPS)
def test_impossible_machine_is_refused_with_file_and_line(what, tmp_path):
    old, new, words = LOOPS[what]
    path = tmp_path / "bad.yaml"
    path.write_text((fused.CONFIGS / "machines" / "belt.yaml").read_text().replace(old, new, 1))
    with pytest.raises(UserError, match=rf"bad.yaml:\d+: .*{words}"):
        load_config(str(path), [])


def test_settings_survive_a_round_trip_through_json_data():
    settings = config("gantry")
    again = machines.settings(settings.model_dump(mode="json", exclude_unset=True))
    assert again == settings and type(again) is type(settings)


def test_schema_of_a_described_machine_has_its_parts():
    assert load_settings(fused.CONFIGS / "machines" / "belt.yaml", described.DescribedConfig, widen=machines.OWN)
