"""The encoder's factor by the way of the reels, on counts made by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.diagnose.model import Model
from rtctl.diagnose.reels import factor

DT = 2e-3
T = DT * np.arange(10000)
WAY = 60.0 * (1 - np.cos(2 * np.pi * 0.1 * T))  # rad of the capstan
OWNER = Model("ivu", {"R1": 0.038, "R2": 0.022, "R_c": 0.0125})


def stand(relative=0.0, R1=0.038, R2=0.022, tolerance=0.02, slow=1.0):
    """An encoder that reads 1 + relative times too much, and reels of true radii R1 and R2."""
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(slow * WAY)))])
    true = {f"reel{i}_counts": np.floor(travelled * 0.0125 / R * 209 / (2 * np.pi)) for i, R in ((1, R1), (2, R2))}
    read = (1 + relative) * travelled
    out = np.stack([(1 + relative) * slow * WAY * 10000 / (2 * np.pi),
                    *(read * 0.0125 / OWNER.base[f"R{i}"] * 209 / (2 * np.pi) for i in (1, 2))], axis=1)  # fmt: skip
    return SimpleNamespace(
        record=SimpleNamespace(plant="ivu", dt=DT, y=true), channels=("capstan_counts", *true), run=lambda model: out,
        case=SimpleNamespace(tolerance=lambda name: tolerance),
    )  # fmt: skip


@pytest.mark.parametrize("relative", [-0.07, 0.08])
def test_it_is_told_with_what_the_radii_leave_open(relative):
    found = factor(stand(relative), OWNER, OWNER)  # type: ignore[arg-type]
    assert found.relative == pytest.approx(relative, abs=0.005)
    assert found.low < relative < found.high


def test_radii_within_their_tolerance_explain_it():
    assert factor(stand(0.0), OWNER, OWNER) is None  # type: ignore[arg-type]
    assert factor(stand(0.0, R1=0.0386, R2=0.0223), OWNER, OWNER) is None  # type: ignore[arg-type]
    assert factor(stand(0.015), OWNER, OWNER) is None  # type: ignore[arg-type]
    assert factor(stand(0.07, tolerance=0.1), OWNER, OWNER) is None  # type: ignore[arg-type]


def test_one_reel_alone_does_not_blame_the_encoder():
    assert factor(stand(0.0, R1=0.045), OWNER, OWNER) is None  # type: ignore[arg-type]


def test_a_short_way_says_nothing():
    assert factor(stand(0.07, slow=0.015), OWNER, OWNER) is None  # type: ignore[arg-type]
