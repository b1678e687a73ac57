"""Plan of a campaign file: settings of every run, and refused files."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from rtctl import machines
from rtctl.campaign.plan import Plan, load_plan
from rtctl.cli.common import load_config
from rtctl.config.errors import UserError

Make = Callable[..., Plan]


def test_plan_has_every_combination_once_with_the_last_axis_fastest(plan: Make) -> None:
    made = plan()
    assert made.runs == 6
    assert [tuple(made.labels(n).values()) for n in range(6)] == [(g, s) for g in (25, 31.0) for s in (1, 2, 3)]
    assert sorted(n for c in range(made.chunks) for n in made.numbers(c)) == list(range(6))
    assert made.config(5).loop.seed == 3 and made.config(5).law.position.gain == 31.0
    assert made.config(0).loop.mode == "fused" and made.config(0).faults[0].size == pytest.approx(0.02)


def test_plan_survives_json_bit_exact(plan: Make) -> None:
    made = plan(matrix={"radius.R1": {"random": [0.02, 0.04], "count": 5, "seed": 3}})
    again = Plan(json.loads(json.dumps(made.payload)))
    assert again.identity == made.identity and again.schema.equals(made.schema)
    assert [again.config(n) for n in range(5)] == [made.config(n) for n in range(5)]


def test_changed_campaign_has_another_hash(plan: Make) -> None:
    one = plan().identity
    assert one == plan().identity
    assert (
        len({one, plan(seconds=2).identity, plan(matrix={}).identity, plan(config="ldu", matrix={}, set={}).identity})
        == 4
    )


def test_plan_with_several_machines(plan: Make) -> None:
    made = plan(config="ivu", set={}, matrix={"config": ["ivu", "ldu"], "loop.seed": [1, 2]})
    assert [made.config(n).machine for n in range(4)] == ["ivu", "ivu", "ldu", "ldu"]


def test_machine_config_is_a_campaign_of_one_run(tmp_path: Path) -> None:
    data = yaml.safe_load(Path("configs/ldu.yaml").read_text()) if Path("configs/ldu.yaml").exists() else None
    if data is None:
        pytest.skip("not run from the project's root: configs/ldu.yaml is missing")
    data["reference"] = {"knots": [[0.0, 0.0], [0.5, 0.002]], "repeat": 1.0, "relative": True}
    path = tmp_path / "experiment.yaml"
    path.write_text(yaml.safe_dump(data))
    made = load_plan(str(path), load_config)
    assert made.runs == 1 and made.config(0).machine == "ldu" and made.config(0).loop.mode == "fused"
    machine = machines.build(made.config(0))
    assert made.ticks(machine) == round(3.0 * machine.rate)  # length of the reference plus 2 s
    longer = load_plan(str(path), load_config, seconds=5.0)
    assert longer.ticks(machine) == round(5.0 * machine.rate)


def test_shipped_campaign_loads() -> None:
    made = load_plan("radii_10000", load_config)
    assert made.runs == 10_000
    for n in (0, 4321, 9999):
        config = made.config(n)
        R1, R2 = config.plant.parameters.R1, config.plant.parameters.R2
        assert (config.radius.R1, config.radius.R2) == (R1, R2)
        assert R1**2 + R2**2 == pytest.approx(0.038**2 + 0.022**2, rel=1e-4)
        assert len(config.reference.steps) == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"campain": "x"}, "campain: unknown key; did you mean 'campaign'?"),
        ({"campaign": None}, "missing key 'campaign'"),
        ({"config": "ivx"}, "config: 'ivx': no such file; did you mean 'ivu'?"),
        ({"set": {"law.position.gain": -1}}, "out of bounds"),
        ({"set": {"law.positon": 1}}, "did you mean 'position'?"),
        ({"seconds": "5 mm"}, "seconds"),
        ({"metrics": ["final_eror_mm"]}, "did you mean 'final_error_mm'?"),
        ({"keep": {"by": "overshoot"}}, "did you mean 'overshoot_pct'?"),
        ({"keep": {"bundles": "most"}}, "'most' is not one of some, all, none"),
        ({"metrics": ["overshoot_pct"]}, "not among them"),
        ({"reference": "nowhere"}, "reference: 'nowhere': no such file"),
    ],
)
def test_plan_error_names_file_line_and_key(write: Callable[..., Path], changes: Any, words: str) -> None:
    path = write(**changes)
    with pytest.raises(UserError) as caught:
        load_plan(str(path), load_config)
    assert words in str(caught.value) and str(path) in str(caught.value)


def test_empty_and_missing_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.yaml").write_text("")
    with pytest.raises(UserError, match="missing key 'campaign'"):
        load_plan(str(tmp_path / "empty.yaml"), load_config)
    with pytest.raises(UserError, match="no such file"):
        load_plan(str(tmp_path / "none.yaml"), load_config)


def test_run_that_does_not_fit_into_memory_is_refused(plan: Make) -> None:
    made = plan(seconds=1e6)
    with pytest.raises(UserError, match="a run of a campaign has 2 to"):
        made.ticks(machines.build(made.config(0)))
