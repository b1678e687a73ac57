"""Regressions: changes beyond the noise of the seeds."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl.campaign import campaign
from rtctl.campaign.compare import BETTER, SAME, WORSE, compare
from rtctl.campaign.plan import Plan
from rtctl.campaign.store import Store, load_results
from rtctl.config.errors import UserError

Make = Callable[..., Plan]
SEEDS = 12
MATRIX = {"law.position.gain": [25, 31], "loop.seed": {"range": [1, SEEDS]}}


@pytest.fixture
def made_up(plan: Make, tmp_path: Path) -> Callable[..., tuple[Any, Path]]:
    """`made_up("new", error=f)`: a finished campaign with synthetic metrics f(gain, seed)."""

    def make(name: str, error: Any, trip: Any = lambda gain, seed: "", **changes: Any) -> tuple[Any, Path]:
        made = plan(**{"matrix": MATRIX, "metrics": ["final_error_mm", "tension_min_N"], **changes})
        store = Store(tmp_path / name, made)
        for chunk in range(made.chunks):
            rows = []
            for n in made.numbers(chunk):
                axes = made.labels(n)
                gain, seed = axes.get("law.position.gain", 0), axes.get("loop.seed", 0)
                values = {"final_error_mm": error(gain, seed), "tension_min_N": error(gain, seed)}
                rows.append({"run": n, **axes, **values, "trip": trip(gain, seed), "error": ""})
            store.add(chunk, rows)
        store.finish()
        return load_results(tmp_path / name), tmp_path / name

    return make


def noise(scale: float, start: int) -> Callable[[float, int], float]:
    return lambda gain, seed: 0.05 + scale * float(np.random.default_rng((start, int(gain), seed)).normal())


def test_noise_is_no_regression(made_up: Any) -> None:
    (_, folder), (plan, table) = made_up("old", noise(0.01, 1))[0:2], made_up("new", noise(0.01, 2))[0]
    found = compare(plan, table, folder)
    assert found.matched == 2 * SEEDS and found.regressions == 0 and {c.verdict for c in found.changes} == {SAME}


def test_change_beyond_noise_is_a_regression_of_its_group(made_up: Any) -> None:
    folder = made_up("old", noise(0.002, 1))[1]
    worse = noise(0.002, 2)
    plan, table = made_up("new", lambda gain, seed: worse(gain, seed) + (0.02 if gain == 31 else 0.0))[0]
    found = compare(plan, table, folder)
    assert [(c.metric, c.group["law.position.gain"]) for c in found.of(WORSE)] == [("final_error_mm", 31)]
    assert [(c.metric, c.group["law.position.gain"]) for c in found.of(BETTER)] == [("tension_min_N", 31)]
    assert found.regressions == 1 and found.of(WORSE)[0].change == pytest.approx(0.02, abs=0.003)


def test_regression_threshold_without_seeds_is_five_percent(made_up: Any) -> None:
    few = {"matrix": {"law.position.gain": [25, 31]}}
    folder = made_up("old", lambda gain, seed: 1.0, **few)[1]
    plan, table = made_up("new", lambda gain, seed: {25: 1.04, 31: 1.06}[int(gain)], **few)[0]
    found = compare(plan, table, folder)
    assert [c.group["law.position.gain"] for c in found.of(WORSE)] == [31] and np.isnan(found.of(WORSE)[0].noise)


def test_newly_failed_run_is_a_regression(made_up: Any) -> None:
    folder = made_up("old", noise(0.0, 1), trip=lambda g, s: "link_lost" if (g, s) == (25, 3) else "")[1]
    plan, table = made_up("new", noise(0.0, 1), trip=lambda g, s: "link_lost" if (g, s) == (31, 2) else "")[0]
    found = compare(plan, table, folder)
    assert found.broken == [SEEDS + 1] and len(found.mended) == 1 and found.regressions == 1


def test_only_matching_runs_are_compared(made_up: Any) -> None:
    folder = made_up("old", noise(0.0, 1), matrix={**MATRIX, "law.position.gain": [31, 40]})[1]
    plan, table = made_up("new", noise(0.0, 1))[0]
    assert compare(plan, table, folder).matched == SEEDS


def test_lost_metric_is_a_regression(made_up: Any) -> None:
    folder = made_up("old", noise(0.001, 1))[1]
    plan, table = made_up("new", lambda g, s: None if (g, s) == (31, 4) else noise(0.001, 1)(g, s))[0]
    worse = compare(plan, table, folder).of(WORSE)
    assert [(c.metric, c.runs) for c in worse] == [("final_error_mm", 1), ("tension_min_N", 1)]
    assert all(np.isnan(c.now) for c in worse)


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        ({"law.position.gain": [1, 2]}, "cannot be told apart"),
        ({"law.position.gain": [70], "loop.seed": [1]}, "nothing to compare"),
    ],
)
def test_campaigns_that_do_not_match_are_refused(made_up: Any, matrix: Any, words: str) -> None:
    folder = made_up("old", noise(0.0, 1), matrix=matrix)[1]
    plan, table = made_up("new", noise(0.0, 1))[0]
    with pytest.raises(UserError, match=words):
        compare(plan, table, folder)


@pytest.mark.usefixtures("blank")
def test_report_contains_the_regressions(plan: Make, tmp_path: Path) -> None:
    campaign.run(plan(matrix=MATRIX), tmp_path / "old")
    slower = {"reference": {"steps": [{"at": 0.1, "to": 1.0}]}, "law.shaper.bandwidth": "5 rad/s"}
    found = campaign.run(plan(matrix=MATRIX, set=slower), tmp_path / "new", baseline=tmp_path / "old")
    assert found["baseline"]["matched"] == 2 * SEEDS and found["baseline"]["regressions"] > 0
    assert "settling_s" in {c["metric"] for c in found["baseline"]["worse"]}
    page = Path(found["report"]).read_text()
    assert "Regressions" in page and "Student" in page and "the outline is the baseline" in page
    same = campaign.run(plan(matrix=MATRIX), tmp_path / "same", baseline=tmp_path / "old")
    assert same["baseline"]["regressions"] == 0
