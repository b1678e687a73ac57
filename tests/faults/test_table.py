"""Every fault on both machines in lockstep: detection, and no rows lost before the trip."""

from pathlib import Path

import pytest

from rtctl.faults import page, processes, table
from rtctl.faults.cases import STANDS
from rtctl.faults.drives import Inside
from rtctl.faults.notes import NOTES
from rtctl.faults.play import Outcome, undisturbed
from rtctl.tick.faults import KINDS, PROCESSES

DOCS = Path(__file__).parents[2] / "docs" / "faults.md"
UNSEEN = {  # reason for no trip
    "link.loss": "half of the frames are enough",
    "link.reorder": "the newest wins",
    "dac.stuck": "the loop compensates",
}
UNSEEN_BY_LDU = {**UNSEEN, "adc.open": "it has no analog input", "encoder.noise": "its speed filter takes it"}


@pytest.fixture(scope="module", params=STANDS)
def outcomes(request: pytest.FixtureRequest) -> list[Outcome]:
    return table.boundary(STANDS[request.param], None)


def test_every_fault_of_the_catalogue_is_tested_and_documented(outcomes: list[Outcome]) -> None:
    assert {o.fault for o in outcomes} | set(PROCESSES) == set(KINDS) == set(NOTES)


def test_fault_is_detected_or_has_a_known_reason(outcomes: list[Outcome]) -> None:
    unseen = UNSEEN if outcomes[0].machine == "ivu" else UNSEEN_BY_LDU
    assert {o.fault for o in outcomes if o.trip is None} == set(unseen)
    assert all(o.error < o.allowed for o in outcomes)


def test_trip_writes_zero_in_its_tick(outcomes: list[Outcome]) -> None:
    assert all(o.safe_from_trip == 0 and o.safe == o.detected for o in outcomes if o.trip)


def test_zero_outputs_reach_the_machine_unless_the_link_is_broken(outcomes: list[Outcome]) -> None:
    assert {o.fault for o in outcomes if o.trip and not o.wire} == {"link.silent"}


def test_no_rows_are_lost_and_the_machine_runs_again(outcomes: list[Outcome]) -> None:
    assert all(o.same and o.lost == 0 and o.again for o in outcomes)


def test_documented_fault_table_agrees_with_the_results(outcomes: list[Outcome]) -> None:
    rate = STANDS[outcomes[0].machine].config().loop.rate
    lines = DOCS.read_text(encoding="utf-8").splitlines()
    assert [
        page._outcome(o, rate).rstrip("\n") for o in outcomes if page._outcome(o, rate).rstrip("\n") not in lines
    ] == []


def test_fault_through_the_daemon_processes_gives_the_same_outcome(runtime: Path, tmp_path: Path) -> None:
    """One fault through supervisor, mailbox and recording; the others run inside this process."""
    name = "ldu"
    stand = STANDS[name]._replace(cases=STANDS[name].cases[4:5])
    assert table.boundary(stand, tmp_path) == table.boundary(stand, None)


@pytest.mark.parametrize("name", STANDS)
def test_process_faults_are_survived(runtime: Path, tmp_path: Path, name: str) -> None:
    stand = STANDS[name]
    truth = undisturbed(stand)
    for each in ("side_by_side", "plant_killed", "supervisor_killed"):
        (tmp_path / each).mkdir()
    found = processes.side_by_side(stand, tmp_path / "side_by_side", truth)
    found.append(processes.plant_killed(stand, tmp_path / "plant_killed", truth))
    found.append(processes.supervisor_killed(stand, tmp_path / "supervisor_killed", truth))
    assert {s.fault for s in found} == set(PROCESSES)
    assert [s for s in found if not s.ok] == []
    lines = DOCS.read_text(encoding="utf-8").splitlines()
    assert [s for s in found if page._survived(s).rstrip("\n") not in lines] == []


@pytest.mark.realtime
def test_killed_plant_reconnects(runtime: Path, tmp_path: Path) -> None:
    assert processes.plant_back(STANDS["ivu"], tmp_path).ok


def test_fault_table_fails_for_a_machine_without_limits() -> None:
    """A machine without limits does not detect the faults."""
    stand = STANDS["ivu"]
    ticks = stand.ticks(3.0)
    off = {f"safety__{name}": 0.0 for name in ("following_error", "frozen_time", "disagreement", "current_time")}
    with Inside(stand.config([stand.fault(stand.cases[4])], loop__mode="fused", **off), ticks) as drive:
        drive.to(ticks)
        assert not drive.rows()["trip"].any()
