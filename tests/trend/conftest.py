"""Recordings with a friction change, fitted once for all tests of this folder."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rtctl.trend import trend
from tests.trend.bundles import worn


@pytest.fixture(scope="session")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return worn(tmp_path_factory.mktemp("worn"), 16, 9)


@pytest.fixture(scope="session")
def fitted(recordings: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Folder of the results and the object of `--json`."""
    folder = tmp_path_factory.mktemp("trend") / "out"
    yield folder, trend.run([recordings], folder)
