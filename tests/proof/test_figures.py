"""Figures of the scores: reliability diagram and confusion matrix."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from rtctl.proof import figures

SCORES = {
    "calibration": {
        "names": 30,
        "table": [
            {"from": 0.7, "to": 0.8, "names": 4, "confidence": 0.75, "right": 0.5},
            {"from": 0.9, "to": 1.0, "names": 26, "confidence": 0.97, "right": 1.0},
        ],
    },
    "confusion": {
        "drive.lag": {"drive.lag": 2, "ambiguous": 1},
        "drive.lag+load.spring": {"unnamed": 1},
        "null": {"nothing": 5},
        "unknown": {"unnamed": 3, "drive.offset": 1},
    },
}


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Figures that would be saved to files."""
    kept: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_, **__: kept.append(self))
    return kept


def test_reliability_diagram_has_a_point_and_a_count_for_each_bin(drawn: list[Figure], tmp_path: Path) -> None:
    figures.reliability(SCORES, tmp_path / "reliability.png")
    (axes,) = drawn[0].axes
    points = [line.get_xydata().tolist() for line in axes.lines if line.get_marker() == "o"]
    assert points == [[[0.75, 0.5]], [[0.97, 1.0]]]
    assert [text.get_text().strip() for text in axes.texts] == ["4", "26"]


def test_confusion_matrix_has_single_truths_in_rows_and_case_counts_in_cells(
    drawn: list[Figure], tmp_path: Path
) -> None:
    figures.confusion(SCORES, tmp_path / "confusion.png")
    (axes,) = drawn[0].axes
    truths = [label.get_text() for label in axes.get_yticklabels()]
    answers = [label.get_text() for label in axes.get_xticklabels()]
    assert truths == ["drive.lag", "null", "unknown"]
    assert answers == ["drive.lag", "drive.offset", "ambiguous", "unnamed", "nothing"]
    cells = {(truths[int(t.get_position()[1])], answers[int(t.get_position()[0])]): t.get_text() for t in axes.texts}
    assert cells[("unknown", "drive.offset")] == "1" and cells[("null", "nothing")] == "5"
    assert len(axes.patches) == 2  # frames of the correct cells
