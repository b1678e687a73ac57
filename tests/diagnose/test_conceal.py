import numpy as np
import pytest

from rtctl import machines
from rtctl.config.load import load_settings, set_path
from rtctl.config.yaml_file import find
from rtctl.diagnose.answer.nominal_duty import measure
from rtctl.diagnose.conceal import TYPICAL, conceal, nodes, sized
from rtctl.plants.physics import TERMS, anywhere, having
from rtctl.plants.physics import nodes as where

KINDS = ("ivu", "ldu", "axis")
SEEDS = range(200)


@pytest.fixture(scope="module", params=KINDS)
def config(request):
    return load_settings(find(request.param), machines.CONFIGS[request.param])


def test_concealed_effect_depends_only_on_the_seed(config):
    assert [conceal(config, seed)[1] for seed in range(20)] == [conceal(config, seed)[1] for seed in range(20)]


def test_concealed_effect_is_valid_for_every_seed(config):
    drawn = set()
    for seed in SEEDS:
        hidden, entry = conceal(config, seed)
        TERMS[entry["term"]].settings.model_validate(entry)
        assert entry["node"] in where(TERMS[entry["term"]], config.machine)
        assert len(hidden.plant.physics) == len(config.plant.physics) + 1
        assert hidden.plant.physics[-1].term == entry["term"]
        assert hidden.model_copy(update={"plant": config.plant}) == config
        drawn.add(entry["term"])
    assert len(drawn) > 20


def test_every_effect_can_be_concealed_at_each_of_its_nodes(config):
    """Every draw is within the bounds of its settings."""
    rng = np.random.default_rng(1)
    for name in TERMS:
        for node in nodes(name, config):
            for _ in range(5):
                entry = sized(name, node, config, rng)
                machines.build(set_path(config, f"plant.physics.{len(config.plant.physics)}", entry))


def test_feedback_sensor_is_never_rectified(config):
    assert not set(nodes("sensor.rectified", config)) & set(having(config.machine, "sensor", "feedback"))


def test_known_effects_of_the_config_remain(config):
    node = {"ivu": "drive1"}.get(config.machine, "drive")
    known = set_path(config, "plant.physics", [{"term": "drive.offset", "node": node, "offset": 0.1}])
    hidden, _ = conceal(known, 3)
    assert hidden.plant.physics[0] == known.plant.physics[0]
    assert len(hidden.plant.physics) == 2


def test_concealed_size_scales_with_the_machine():
    light = load_settings(find("axis"), machines.CONFIGS["axis"], ["plant.parameters.F_c=2", "plant.parameters.M=9"])
    heavy = load_settings(find("axis"), machines.CONFIGS["axis"], ["plant.parameters.F_c=20", "plant.parameters.M=90"])
    sizes = [
        sized("friction.coulomb", "carriage", config, np.random.default_rng(5))["F_C"] for config in (light, heavy)
    ]
    assert sizes[1] == pytest.approx(10 * sizes[0], rel=1e-2)


def test_draw_tables_use_existing_parameters_and_measures(config):
    for term in TERMS.values():
        assert set(term.draws) | set(term.chosen) <= set(term.settings.model_fields)
        for span in term.draws.values():
            assert 0 <= span.low <= span.high
            if there := anywhere(term).get(config.machine):
                assert measure(span.measure, there[0], config) > 0
    for term in (term for term in TERMS.values() if term.tabled):
        assert all(term.scale.get(key, "") in TYPICAL for key in term.typical if key not in term.draws)
