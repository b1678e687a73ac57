"""Table of soak ranges: existing signals and settings, and valid bounds."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl import machines
from rtctl.cli.common import load_config
from rtctl.cli.main import main
from rtctl.config.load import get_path, set_path
from rtctl.loop import generate
from rtctl.plants.fmu import FmuSettings
from rtctl.soak import ranges


@pytest.fixture(params=sorted(machines.CONFIGS))
def settings(request: pytest.FixtureRequest, config: Callable[..., Any]) -> Any:
    return config(request.param)


def test_signals_of_the_ranges_are_columns_of_the_row(settings: Any) -> None:
    names = generate.generate(machines.build(settings), "shm").row.names or ()
    r = ranges.range_of(machines.build(settings))
    told = (r.position, r.error, *r.outputs, r.counts, r.truth, *r.tensions, *r.truth_tensions)
    assert not set(told) - set(names)
    assert len(r.tensions) == len(r.truth_tensions)


def test_gains_of_the_ranges_may_change_while_running(settings: Any) -> None:
    gains = ranges.gains_of(settings)
    assert gains
    source = generate.source(machines.build(settings), "shm")
    for path, bounds in gains.items():
        assert bounds[0] < bounds[1] and get_path(settings, path) > 0
        for value in bounds:
            changed = set_path(settings, path, value)
            assert generate.source(machines.build(changed), "shm") == source


def test_law_of_another_kind_has_other_gains(config: Callable[..., Any]) -> None:
    pd = config("axis", set={"law.position": {"kind": "pd", "gain": 30000.0, "tau_d": 0.01}})
    assert set(ranges.gains_of(pd)) == {"law.position.gain"}


def test_output_bounds_are_those_of_law_and_converter(config: Callable[..., Any]) -> None:
    half = 10.0 / 4096
    assert ranges.volts(config("ldu")) == pytest.approx((-3.0 - half, 3.0 + half), abs=half)
    assert ranges.volts(config("ivu", set={"law.limit": {"high": 4.0, "low": -1.0}})) == (-1.0 - half, 4.0 + half)
    assert ranges.volts(config("axis", set={"law.limit": {"high": 40.0}})) == (-10.0 - half, 10.0 + half)


def test_counts_are_checked_unless_a_term_changes_the_sensor(config: Callable[..., Any]) -> None:
    assert ranges.counts_per_unit(config("axis")) == pytest.approx(1e6)
    terms = [{"term": "ripple.encoder", "node": "sensor", "A": 1e-6}]
    assert np.isnan(ranges.counts_per_unit(config("axis", set={"plant.physics": terms})))


@pytest.mark.parametrize(
    ("machine", "without", "empty"),
    [
        ("axis", {}, set()),
        ("axis", {"v=float": "w=float", "s.v": "s.w"}, {"truth_speed"}),
        ("ivu", {}, {"truth_tension1"}),
        ("ldu", {}, set()),
    ],
)
def test_signals_missing_in_a_user_plant_are_not_checked(
    tmp_path: Path, machine: str, without: dict[str, str], empty: set[str]
) -> None:
    main(["new", "plant", "mine", "--for", machine, "--into", str(tmp_path)])
    text = (tmp_path / "mine.py").read_text()
    for old, new in without.items():
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "mine.py").write_text(text)
    own = load_config(str(tmp_path / "mine.yaml"), [])
    assert empty <= ranges.unknown(own)
    if not empty:
        assert f"truth_{'capstan' if machine == 'ivu' else 'x'}" not in ranges.unknown(own)
    assert np.isnan(ranges.counts_per_unit(own)) == (machine == "ldu")


def test_only_sensor_signals_of_an_fmu_are_checked(config: Callable[..., Any]) -> None:
    fmu = FmuSettings(file="a.fmu", inputs={"drive": "u"}, outputs={"sensor": "x"})
    axis = config("axis")
    with_fmu = axis.model_copy(update={"plant": axis.plant.model_copy(update={"fmu": fmu})})
    assert ranges.unknown(with_fmu) == {"truth_x", "truth_speed"} and ranges.unknown(axis) == set()


def test_soak_keeps_the_reference_of_the_config(settings: Any) -> None:
    given = ranges.with_reference(settings)
    assert len(given.reference.knots) > 1
    assert ranges.with_reference(given) is given
    own = set_path(settings, "reference", {"steps": [{"at": 1.0, "to": 0.1}]})
    assert ranges.with_reference(own) is own
