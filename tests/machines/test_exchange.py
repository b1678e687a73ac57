"""Exchange format 1 of each machine: symbols in both directions, columns, and the machine description."""

import pytest

from rtctl import machines
from rtctl.config.load import load_settings
from rtctl.config.yaml_file import find
from rtctl.machines.exchange import digits, lines
from rtctl.machines.profiles import PROFILES
from rtctl.plants.physics.place import PLANTS

DECLARED = {kind: profile.exchange for kind, profile in PROFILES.items() if profile.exchange is not None}


@pytest.mark.parametrize("kind", DECLARED)
def test_symbols_of_a_config_fill_the_machine_description(kind):
    exchange = DECLARED[kind]
    found = exchange.symbols(load_settings(find(kind), machines.CONFIGS[kind], []).plant)
    machine = PLANTS[kind].described().layout.machine
    assert set(machine.symbols) <= set(found)
    assert set(exchange.terms) <= set(found) and set(exchange.exact) <= set(found)
    again = exchange.settings(found)
    assert {name: again[name] for name in found} == pytest.approx(found)


@pytest.mark.parametrize("kind", DECLARED)
def test_counters_are_columns_of_the_description(kind):
    columns = {sensor.column for sensor in PLANTS[kind].described().layout.machine.sensors.values()}
    assert set(DECLARED[kind].scales) <= columns


def test_gear_ratio_determines_the_pulley_radius():
    exchange = DECLARED["ldu"]
    found = exchange.settings({"R_t": 0.03, "R_s": 0.0015, "N": 19.0})
    assert found["R_t"] / found["R_s"] == pytest.approx(19.0)


def test_encoder_counts_become_lines_times_four_if_divisible():
    left = []
    assert lines(10000.0, "it", "sensors.it", left) == {"sensors.it": {"lines": 2500}} and left == []
    assert lines(10001.0, "it", "sensors.it", left) == {"sensors.it": {"lines": 10001, "multiply": 1}}
    assert lines(None, "it", "sensors.it", left) == {} and left == []
    assert lines(99.6, "it", "sensors.it", left) and left == ["it, 99.6 counts a turn: 100 are taken"]
    assert digits(1.23456789) == 1.23457
