"""Lines of each compensation in the generated tick of every machine."""

import ast

import pytest

from rtctl import machines
from rtctl.cli.common import load_config
from rtctl.config.load import set_paths
from rtctl.loop.generate import source

MACHINES = {"ivu": "ivu", "ldu": "ldu", "belt": "configs/machines/belt.yaml"}
SETTINGS = {
    "feedforward": ({"lead": 1e-3}, "model_feedforward.begin"),
    "integral": ({"gain": 1.0}, "integral.step"),
    "observer": ({"bandwidth": 2.0, "acceleration": 10.0}, "disturbance_observer.step"),
    "filter": ({"sections": [{"kind": "notch", "frequency": 90.0, "zeta_z": 0.1, "zeta_p": 0.5}]}, "sections.step"),
    "map": ({"span": 6.28, "values": [0.0, 0.1]}, "map_feedforward.step"),
    "learning": ({"duration": 1.0, "values": [0.0, 0.1]}, "iterative_learning.step"),
    "repetitive": ({"period": 6.28, "gain": 1.0, "slow": 0.1}, "repetitive.step"),
    "predictor": ({"delay": 3, "acceleration": 10.0}, "predictor.step"),
    "correction": ({"period": 6.28, "values": [0.0, 0.001]}, "error_table.step"),
    "inverse": ({"points": [(-9.0, -10.0), (9.0, 10.0)]}, "inverse_curve.step"),
}


def tick(config):
    """Text of the tick of a config, without the rest of its module."""
    text = source(machines.build(config), "shm")
    tree = ast.parse(text)
    found = next(node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == "tick")
    return ast.unparse(found)


@pytest.fixture(scope="module")
def config():
    return {name: set_paths(load_config(path, []), {"loop.mode": "fused"}) for name, path in MACHINES.items()}


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("kind", SETTINGS)
def test_each_compensation_adds_its_lines_to_the_tick_of_every_machine(name, kind, config):
    settings, line = SETTINGS[kind]
    plain = tick(config[name])
    made = tick(set_paths(config[name], {f"law.compensation.{kind}": settings}))
    assert line in made
    if kind not in ("filter", "correction") or name == "belt":
        assert line not in plain


@pytest.mark.parametrize("name", MACHINES)
def test_all_compensations_can_be_combined(name, config):
    every = {f"law.compensation.{kind}": settings for kind, (settings, _) in SETTINGS.items()}
    made = tick(set_paths(config[name], every))
    assert all(line in made for _, line in SETTINGS.values())


@pytest.mark.parametrize("name", MACHINES)
def test_arming_resets_every_compensation_with_state(name, config):
    every = {f"law.compensation.{kind}": settings for kind, (settings, _) in SETTINGS.items()}
    made = tick(set_paths(config[name], every))
    for module in ("model_feedforward", "integral", "disturbance_observer", "repetitive", "predictor", "sections"):
        assert f"{module}.reset" in made


def test_anti_windup_tracks_the_command_before_the_limit(config):
    inverse = {"law.compensation.inverse": SETTINGS["inverse"][0], "law.compensation.integral": {"gain": 1.0}}
    made = tick(set_paths(config["belt"], inverse))
    assert "integral.track(p.integral, s.integral, asked, u)" in made
    assert "limit.step(p.limit, s.limit, asked)" in made


def test_compensation_settings_use_the_units_of_the_machine(config):
    integral = {"gain": "2 V/mm/s", "dead_zone": "3 um"}
    found = set_paths(config["ldu"], {"law.compensation.integral": integral}).law.compensation.integral
    assert found.gain == pytest.approx(2000.0) and found.dead_zone == pytest.approx(3e-6)


def test_compensation_at_an_unknown_node_is_refused(config):
    effect = {"effect": {"term": "friction.coulomb", "node": "wheel", "F_C": 1.0}}
    with pytest.raises(Exception, match=r"effects\.0\.effect\.node: friction\.coulomb cannot stand at 'wheel'"):
        set_paths(config["belt"], {"law.compensation.feedforward": {"effects": [effect]}})


def test_repetitive_control_without_a_shaped_reference_is_refused(config):
    settings = {"law.compensation.repetitive": {"period": 6.28, "gain": 1.0, "slow": 0.1}, "law.shaper": {}}
    with pytest.raises(Exception, match=r"law\.compensation\.repetitive .* law\.shaper\.bandwidth is missing"):
        machines.build(set_paths(config["belt"], settings))
