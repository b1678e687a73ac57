"""One run of a campaign: rows equal to a single run, modules shared by structure, errors in the result row."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rtctl import machines
from rtctl.campaign import cell
from rtctl.campaign.plan import Plan
from rtctl.loop import fused, generate

Make = Callable[..., Plan]


def test_campaign_run_is_bit_exact_with_a_single_run(plan: Make) -> None:
    made = plan()
    rows, alone = cell.play(made, 4).rows, fused.run(made.config(4), 1.8).rows
    for name in rows.dtype.names or ():
        if name != "order":
            assert np.array_equal(rows[name].view(np.int64), alone[name].view(np.int64)), name


def test_runs_that_differ_in_numbers_share_a_module(plan: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Any] = []
    made, generated = plan(), generate.generate
    monkeypatch.setattr(generate, "generate", lambda *a: calls.append(a) or generated(*a))
    cell.clear()
    for n in range(made.runs):
        cell.run_row(made, n)
    assert len(calls) == 1


@pytest.mark.parametrize("change", [{"law.position.gain": 20}, {"loop.seed": 9}, {"plant.parameters.R1": 0.03}])
def test_structure_key_follows_the_generated_source(plan: Make, change: dict[str, Any]) -> None:
    one = machines.build(plan(matrix={}).config(0))
    other = machines.build(plan(matrix={k: [v] for k, v in change.items()}).config(0))
    assert cell.structure(one) is cell.structure(other)
    assert generate.source(one, "shm") == generate.source(other, "shm")


def test_another_diagram_is_another_structure(plan: Make) -> None:
    plain = machines.build(plan(matrix={}).config(0))
    physics = plan(matrix={"plant.physics": [[{"term": "friction.coulomb", "node": "motor1", "F_C": 1e-3}]]})
    traced = plan(matrix={"record.trace": [["position.d"]]})
    for other in (physics, traced):
        machine = machines.build(other.config(0))
        assert cell.structure(machine).path != cell.structure(plain).path


def test_failed_run_has_its_error_in_its_row(plan: Make) -> None:
    made = plan(matrix={"law.position.gain": [-3, 31]})
    broken, whole = (cell.run_row(made, n) for n in range(2))
    assert "law.position.gain: -3 V/rad is out of bounds" in broken["error"]
    assert broken["final_error_mm"] is None and broken["law.position.gain"] == -3
    assert whole["error"] == "" and 0 < whole["final_error_mm"] < 0.1


def test_tripped_run_has_a_trip_time_and_no_final_error(plan: Make) -> None:
    made = plan(matrix={"faults": [[{"fault": "encoder.freeze", "at": 0.6}]]})
    row = cell.run_row(made, 0)
    assert row["trip"] == "encoder_frozen" and row["error"] == ""
    assert 0.6 < row["trip_s"] < 1.2 and row["final_error_mm"] is None and row["peak_output_V"] > 1


def test_run_that_never_starts_is_an_error(plan: Make) -> None:
    assert "give it more `seconds`" in cell.run_row(plan(seconds=0.2), 0)["error"]


def test_chunk_of_another_process_is_bit_exact(plan: Make) -> None:
    made = plan()
    assert cell.run_chunk(made.payload, made.identity, 2) == [cell.run_row(made, n) for n in made.numbers(2)]
