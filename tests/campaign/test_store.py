"""Folder of a campaign: bit-exact resumption, never mixed with another campaign."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from rtctl.campaign import cell
from rtctl.campaign.plan import Plan
from rtctl.campaign.store import CAMPAIGN, PARTS, RESULTS, Store, load_results
from rtctl.config.errors import UserError

Make = Callable[..., Plan]


def fill(store: Store, *chunks: int) -> Store:
    for chunk in chunks:
        store.add(chunk, cell.run_chunk(store.plan.payload, store.plan.identity, chunk))
    return store


@pytest.fixture
def half(plan: Make, tmp_path: Path) -> tuple[Plan, Path]:
    """A campaign with three of six chunks done, out of order."""
    made = plan()
    fill(Store(tmp_path / "out", made), 4, 0, 2)
    return made, tmp_path / "out"


def test_resumed_campaign_gives_an_identical_file(half: tuple[Plan, Path], tmp_path: Path) -> None:
    made, folder = half
    store = Store(folder, made)
    assert store.done() == {0, 2, 4} and not store.finished()
    fill(store, 1, 3, 5).finish()
    fill(Store(tmp_path / "at once", made), *range(6)).finish()
    assert (folder / RESULTS).read_bytes() == (tmp_path / "at once" / RESULTS).read_bytes()
    assert Store(folder, made).done() == set(range(6)) and not (folder / PARTS).exists()


def test_result_table_has_columns_and_units(half: tuple[Plan, Path]) -> None:
    made, folder = half
    table = fill(Store(folder, made), 1, 3, 5).finish()
    assert table["run"].to_pylist() == list(range(6))
    assert table["law.position.gain"].to_pylist() == [25.0] * 3 + [31.0] * 3
    assert table.schema.field("law.position.gain").metadata == {b"unit": b"V/rad"}
    plan, read = load_results(folder)
    assert plan.identity == made.identity and read.equals(table.select(read.schema.names))


def test_damaged_part_is_computed_again(half: tuple[Plan, Path]) -> None:
    made, folder = half
    path = folder / PARTS / "part-000002.parquet"
    path.write_bytes(path.read_bytes()[:-20])
    assert Store(folder, made).done() == {0, 4}


def test_part_of_another_campaign_is_ignored(half: tuple[Plan, Path], plan: Make, tmp_path: Path) -> None:
    made, folder = half
    other = plan(seconds=1.7)
    fill(Store(tmp_path / "other", other), 1)
    (folder / PARTS / "part-000001.parquet").write_bytes(
        (tmp_path / "other" / PARTS / "part-000001.parquet").read_bytes()
    )
    assert Store(folder, made).done() == {0, 2, 4}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"seconds": 2}, "another seconds"),
        ({"matrix": {"loop.seed": [1]}}, "another matrix"),
        ({"set": {}}, "another config"),
        ({"campaign": "x", "metrics": ["final_error_mm"]}, "another campaign and another metrics"),
    ],
)
def test_folder_of_another_campaign_is_refused(half: tuple[Plan, Path], plan: Make, changes: Any, words: str) -> None:
    with pytest.raises(UserError, match=words):
        Store(half[1], plan(**changes))


def test_unsuitable_folder_is_refused(plan: Make, tmp_path: Path) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").write_text("")
    with pytest.raises(UserError, match="holds no campaign"):
        Store(tmp_path / "full", plan())
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError):
        Store(tmp_path / "file", plan())
    with pytest.raises(UserError, match="is not the folder of a campaign"):
        load_results(tmp_path)


def test_unreadable_results_are_an_error(half: tuple[Plan, Path]) -> None:
    made, folder = half
    with pytest.raises(UserError, match="was not finished"):
        load_results(folder)
    (folder / RESULTS).write_bytes(b"PAR1")
    with pytest.raises(UserError, match="cannot be read as Parquet"):
        load_results(folder)
    (folder / CAMPAIGN).write_text("{")
    with pytest.raises(UserError, match="cannot be read"):
        Store(folder, made)
    (folder / CAMPAIGN).write_text("{}")
    with pytest.raises(UserError, match="is damaged"):
        load_results(folder)


def test_columns_of_mixed_types_are_text(plan: Make, tmp_path: Path) -> None:
    made = plan(matrix={"radius.source": ["given"], "plant.rate": [None, 2000]})
    table = fill(Store(tmp_path / "out", made), 0, 1).finish()
    assert table["plant.rate"].to_pylist() == [None, "2000"]
    assert json.loads((tmp_path / "out" / CAMPAIGN).read_text())["campaign"] == "small"
    assert pq.read_metadata(tmp_path / "out" / RESULTS).num_rows == 2
