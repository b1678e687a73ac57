"""A whole campaign: rows, bundles, report, conditions and baseline."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl.campaign import campaign, cell, pools
from rtctl.campaign.conditions import parse
from rtctl.campaign.listing import listing, words
from rtctl.campaign.plan import Plan
from rtctl.campaign.store import load_results
from rtctl.config.errors import UserError
from rtctl.trace.bundle import load_bundle
from rtctl.trace.replay import replay

Make = Callable[..., Plan]
FREEZE = {"values": {"none": [], "freeze": [{"fault": "encoder.freeze", "at": 0.6}]}}


def test_failed_run_is_kept_and_the_others_continue(plan: Make, tmp_path: Path) -> None:
    made = plan(matrix={"law.position.gain": [25, 31, -3], "faults": FREEZE, "loop.seed": [1, 2]})
    told: list[tuple[int, int, int]] = []
    conditions = [parse(text, made.metrics) for text in ("final_error_mm.max > 0.01", "trip.count > 4")]
    found = campaign.run(made, tmp_path / "out", fail_on=conditions, progress=lambda *a: told.append(a))
    assert (found["runs"], found["errors"], found["trips"], found["failed"]) == (12, 4, 4, 8)
    assert [f["failed"] for f in found["fail_on"]] == [True, False]
    assert told[0] == (0, 12, 0) and told[-1] == (12, 12, 8)
    assert {Path(b).name for b in found["bundles"]} == {
        f"run-{n:06d}" for n in (0, 2, 3, 6, 7)
    }  # the worst runs and the trips
    page = Path(found["report"]).read_text()
    links = re.findall(r'href="([^"]+)"', page)
    assert links and all((tmp_path / "out" / link / "recording.parquet").is_file() for link in links)
    assert "encoder_frozen" in page and "-3 V/rad is out of bounds" in page and "8 failed" in page
    assert not re.search(r'(?:src|href)="(?:https?:)?//', page) and page.count("data:image/png;base64,") == 4


@pytest.mark.usefixtures("blank")
def test_kept_bundle_agrees_with_its_run_and_replays(plan: Make, tmp_path: Path) -> None:
    made = plan(matrix={"faults": FREEZE})
    found = campaign.run(made, tmp_path / "out")
    for number, folder in enumerate(map(Path, sorted(found["bundles"]))):
        bundle = load_bundle(folder)
        rows = cell.play(made, number).rows
        assert all(np.array_equal(bundle.columns[name], rows[name]) for name in rows.dtype.names or ())
        assert bundle.case["campaign"]["run"] == number and bundle.case["campaign"]["name"] == "small"
        assert replay(folder).identical


@pytest.mark.usefixtures("blank")
@pytest.mark.parametrize(("keep", "count"), [({"bundles": "none"}, 0), ({"bundles": "all"}, 6), ({"worst": 2}, 2)])
def test_keep_selects_the_bundles(plan: Make, tmp_path: Path, keep: Any, count: int) -> None:
    assert len(campaign.run(plan(keep=keep), tmp_path / "out")["bundles"]) == count


@pytest.mark.usefixtures("blank")
def test_repeated_campaign_computes_nothing(plan: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = campaign.run(plan(), tmp_path / "out")
    results = Path(first["results"]).read_bytes()
    asked: list[int] = []
    monkeypatch.setattr(pools, "compute", lambda plan, chunks, *_: asked.extend(chunks) or iter(()))
    again = campaign.run(plan(), tmp_path / "out")
    assert first["computed"] == 6 and again["computed"] == 0 and not asked
    assert str(again["metrics"]) == str(first["metrics"]) and Path(again["results"]).read_bytes() == results


@pytest.mark.usefixtures("blank")
def test_interrupted_campaign_continues(plan: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = pools.compute

    def breaks(made: Plan, chunks: Any, *more: Any) -> Any:
        for done, pair in enumerate(whole(made, chunks, *more)):
            if done == 4:
                raise KeyboardInterrupt
            yield pair

    monkeypatch.setattr(pools, "compute", breaks)
    with pytest.raises(KeyboardInterrupt):
        campaign.run(plan(), tmp_path / "out")
    monkeypatch.setattr(pools, "compute", whole)
    assert campaign.run(plan(), tmp_path / "out")["computed"] == 2
    campaign.run(plan(), tmp_path / "other")
    assert (tmp_path / "out/results.parquet").read_bytes() == (tmp_path / "other/results.parquet").read_bytes()


@pytest.mark.usefixtures("blank")
def test_trip_can_be_a_valid_result(plan: Make, tmp_path: Path) -> None:
    found = campaign.run(plan(matrix={"faults": FREEZE}, trips="result"), tmp_path / "out")
    assert found["trips"] == 1 and found["failed"] == 0


@pytest.mark.usefixtures("blank")
def test_campaign_with_all_runs_failed(plan: Make, tmp_path: Path) -> None:
    found = campaign.run(plan(matrix={"law.position.gain": [-1, -2]}), tmp_path / "out")
    assert found["failed"] == 2 and found["metrics"]["final_error_mm"]["count"] == 0 and not found["bundles"]


@pytest.mark.usefixtures("blank")
def test_report_of_two_machines(plan: Make, tmp_path: Path) -> None:
    made = plan(matrix={"config": ["ivu", "configs/ivu.yaml" if Path("configs/ivu.yaml").exists() else "ivu"]}, set={})
    found = campaign.run(made, tmp_path / "out")
    assert Path(found["report"]).read_text().count("Steps and errors of") == len(set(made.columns["config"]))


def test_invalid_baseline_is_refused_before_the_runs(plan: Make, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="is not the folder of a campaign"):
        campaign.run(plan(), tmp_path / "out", baseline=tmp_path / "nowhere")
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("blank")
def test_listing_of_failures_and_worst_runs(plan: Make, tmp_path: Path) -> None:
    made = plan(matrix={"law.position.gain": [25, 31, -3]})
    campaign.run(made, tmp_path / "out")
    plan_, table = load_results(tmp_path / "out")
    found = listing(plan_, table, tmp_path / "out", 5)
    assert [e["run"] for e in found["failures"]] == [2] and {e["run"] for e in found["worst"]} == {0, 1}
    assert found["worst"][0]["final_error_mm"] >= found["worst"][1]["final_error_mm"]
    assert Path(found["worst"][0]["bundle"]).is_dir()
    text = "\n".join(words(found))
    assert "law.position.gain=-3" in text and "out of bounds" in text
    low = listing(plan_, table, tmp_path / "out", 5, "tension_min_N")["worst"]
    assert low[0]["tension_min_N"] <= low[1]["tension_min_N"]  # smaller is worse
    with pytest.raises(UserError, match="did you mean 'settling_s'"):
        listing(plan_, table, tmp_path / "out", 5, "setling_s")
