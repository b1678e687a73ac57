"""Small campaigns, written to files and run."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from rtctl.campaign.plan import Plan, load_plan
from rtctl.cli.common import load_config

STEP = {"steps": [{"at": 0.1, "to": 1.0}]}
BASE = {
    "campaign": "small",
    "config": "ivu",
    "seconds": "1.8 s",
    "set": {"reference": STEP, "faults": [{"fault": "link.loss", "size": "2 %"}]},
    "matrix": {"law.position.gain": [25, "31 V/rad"], "loop.seed": {"range": [1, 3]}},
    "keep": {"worst": 1},
}


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """`write(matrix={...})`: file of the campaign above with changed keys; None omits a key."""

    def make(**changes: Any) -> Path:
        data = {key: value for key, value in {**BASE, **changes}.items() if value is not None}
        path = tmp_path / "campaign.yaml"
        path.write_text(yaml.safe_dump(data, sort_keys=False))
        return path

    return make


@pytest.fixture
def plan(write: Callable[..., Path]) -> Callable[..., Plan]:
    """`plan(matrix={...})`: plan of a file of `write`."""
    return lambda **changes: load_plan(str(write(**changes)), load_config)


@pytest.fixture
def blank(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stub of the plots: drawing would take longer than the runs."""
    for name in ("overlay", "distributions", "along", "png"):
        monkeypatch.setattr(f"rtctl.campaign.figures.{name}", lambda *_: "")
