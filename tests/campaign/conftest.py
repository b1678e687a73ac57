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
    """`write(matrix={...})`: the campaign above with other keys, as a file; None leaves a key out."""

    def make(**changes: Any) -> Path:
        data = {key: value for key, value in {**BASE, **changes}.items() if value is not None}
        path = tmp_path / "campaign.yaml"
        path.write_text(yaml.safe_dump(data, sort_keys=False))
        return path

    return make


@pytest.fixture
def plan(write: Callable[..., Path]) -> Callable[..., Plan]:
    """`plan(matrix={...})` is the plan of such a file."""
    return lambda **changes: load_plan(str(write(**changes)), load_config)


@pytest.fixture
def blank(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of nothing: to draw them takes longer than the runs do."""
    for name in ("overlay", "distributions", "along", "png"):
        monkeypatch.setattr(f"rtctl.campaign.figures.{name}", lambda *_: "")
