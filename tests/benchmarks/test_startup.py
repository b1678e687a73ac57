from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest


@pytest.mark.realtime
def test_time_to_the_first_tick_is_measured(
    benchmark_module: Callable[[str], ModuleType], runtime: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    startup = benchmark_module("startup")
    assert 0.0 < startup.start("ivu", "shm", tmp_path, None) < startup.LIMIT
