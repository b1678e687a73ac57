"""Fixtures: machines for short soaks, and restricted sets of events."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rtctl.soak import events, ranges
from rtctl.soak.rig import Fused


@pytest.fixture
def rig(config: Callable[..., Any], tmp_path: Path) -> Callable[..., Fused]:
    """`rig("ivu", {"safety.current": 0.5})`: a fused machine whose rows are checked."""

    def make(kind: str = "ivu", set: dict[str, Any] | None = None, seed: int = 1) -> Fused:
        return Fused(ranges.with_reference(config(kind, set=set)), tmp_path, seed)

    return make


@pytest.fixture
def only(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """`only("fault", faults=["link.silent"])`: soaks of these events and faults only."""

    def narrow(*kinds: str, faults: list[str] | None = None) -> None:
        monkeypatch.setattr(events, "WEIGHTS", dict.fromkeys(kinds, 1.0))
        if faults is not None:
            monkeypatch.setattr(events, "KINDS", faults)

    return narrow
