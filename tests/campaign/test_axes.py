"""Axes: lists, ranges, random values, linked axes, files, and errors."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rtctl.campaign.plan import Plan
from rtctl.config.errors import UserError

Make = Callable[..., Plan]


def values(plan: Plan, name: str) -> list[Any]:
    return next(c["values"] for axis in plan.axes for c in axis if c["name"] == name)


@pytest.mark.parametrize(
    ("axis", "expected"),
    [
        ([31, "2 V/deg"], [31, pytest.approx(114.591559)]),
        ({"range": [20, 40, 10]}, [20, 30, 40]),
        ({"range": [3, 1, -1]}, [3, 2, 1]),
        ({"range": ["20 V/rad", "21 V/rad", "0.25 V/rad"]}, [20, 20.25, 20.5, 20.75, 21]),
        ({"linspace": [0, "10 V/rad", 3]}, [0, 5, 10]),
        ({"values": {"soft": 10, "stiff": 40}}, [10, 40]),
    ],
)
def test_axis_values_are_in_si_units(plan: Make, axis: Any, expected: list[Any]) -> None:
    assert values(plan(matrix={"law.position.gain": axis}), "law.position.gain") == expected


def test_random_values_depend_on_the_seed_only(plan: Make) -> None:
    def draw(seed: int) -> list[float]:
        axis = {"random": ["22 mm", "38 mm"], "count": 50, "seed": seed}
        return values(plan(matrix={"radius.R1": axis}), "radius.R1")

    assert draw(1) == draw(1) != draw(2)
    assert all(0.022 <= x <= 0.038 for x in draw(1)) and len(set(draw(1))) == 50


def test_linked_paths_step_together(plan: Make) -> None:
    radii = {
        "together": {
            "R1": {"paths": ["radius.R1", "plant.parameters.R1"], "values": ["38 mm", "30 mm"]},
            "R2": {"paths": ["radius.R2", "plant.parameters.R2"], "linspace": ["22 mm", "32 mm", 2]},
        }
    }
    made = plan(matrix={"radii": radii, "loop.seed": [1, 2]})
    assert made.runs == 4 and made.labels(3) == {"R1": 0.03, "R2": 0.032, "loop.seed": 2}
    config = made.config(3)
    assert (config.radius.R1, config.plant.parameters.R1, config.radius.R2) == (0.03, 0.03, 0.032)


def test_labels_of_list_valued_axes(plan: Make) -> None:
    faults = {"values": {"none": [], "frozen": [{"fault": "encoder.freeze", "at": "0.6 s"}]}}
    made = plan(
        matrix={"faults": faults, "plant.physics": [[], [{"term": "friction.coulomb", "node": "motor1", "F_C": 1e-3}]]}
    )
    assert made.labels(0) == {"faults": "none", "plant.physics": "none"}
    assert made.labels(3) == {"faults": "frozen", "plant.physics": "friction.coulomb"}
    assert made.config(2).faults[0].fault == "encoder.freeze" and made.config(2).faults[0].at == 0.6


def test_reference_axis_takes_files(plan: Make, tmp_path: Path) -> None:
    (tmp_path / "jump.yaml").write_text("steps: [{at: 0.2 s, to: 12.5 mm}]\n".replace("12.5 mm", "57.3 deg"))
    made = plan(matrix={"reference": ["steps", "jump.yaml"]})  # shipped, and next to the campaign
    assert made.labels(1) == {"reference": "jump.yaml"}
    assert made.config(0).reference.steps[3].at == 10.0
    assert made.config(1).reference.steps[0].to == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        ({"law.position.gian": [1]}, "did you mean 'gain'?"),
        ({"law.position.gain": []}, "has no values"),
        ({"law.position.gain": 5}, "expected keys"),
        ({"law.position.gain": {"range": [1]}}, "needs 2"),
        ({"law.position.gain": {"range": [1, 5, -1]}}, "leads nowhere"),
        ({"law.position.gain": {"range": [1, 5, 0]}}, "leads nowhere"),
        ({"law.position.gain": {"range": [0, 1, 1e-9]}}, "are the most"),
        ({"law.position.gain": {"linspace": [1, 2, 2.5]}}, "whole number"),
        ({"law.position.gain": {"linspace": [1, "2 mm", 2]}}, "is not a quantity in V/rad"),
        ({"law.position.gain": {"random": [1, 2]}}, "needs `count` and `seed`"),
        ({"law.position.gain": {"random": [2, 1], "count": 1, "seed": 1}}, "lowest first"),
        ({"law.position.gain": {"values": [1], "linspace": [1, 2, 3]}}, "values and linspace"),
        ({"law.position.gain": {"valeus": [1]}}, "did you mean 'values'?"),
        ({"law.position.gain": {"values": [1], "seed": 3}}, "go with `random` only"),
        ({"r": {"together": {"radius.R1": [1, 2], "radius.R2": [1]}}}, "equally long"),
        ({"r": {"together": {}}}, "it is empty"),
        ({"r": {"together": {"a": {"together": {}}}}}, "cannot hold another"),
        ({"loop.seed": [1], "s": {"paths": ["loop.seed"], "values": [1]}}, "is changed by 'loop.seed' already"),
        ({"trip": {"paths": ["loop.seed"], "values": [1]}}, "another name"),
        ({"config": "ivu"}, "expected a list of configs"),
        ({"config": ["ivuu"]}, "no such file"),
        ({"reference": ["nowhere"]}, "no such file"),
        ({"reference.steps.first.at": [1]}, "is not an index"),
        ({"loop.seed": {"range": [1, 1001]}, "law.position.gain": {"range": [1, 1001]}}, "1000000 are the most"),
    ],
)
def test_axis_error_names_file_line_and_key(plan: Make, matrix: Any, words: str) -> None:
    with pytest.raises(UserError) as caught:
        plan(matrix=matrix)
    said = str(caught.value)
    assert words in said and "campaign.yaml:" in said and "matrix" in said and "\n" not in said
