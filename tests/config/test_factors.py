"""Factors between units are worked out once and kept in the cache folder."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from rtctl.config import factors, units
from rtctl.config.factors import factor


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RTCTL_CACHE_DIR", str(tmp_path))
    factors._kept.cache_clear()
    yield tmp_path
    factors._kept.cache_clear()


def never(unit: str, target: str) -> float:
    raise AssertionError(f"{unit} is worked out again")


def test_factor_is_worked_out_once(folder: Path) -> None:
    assert factor("ms", "s", "a", lambda *_: 1e-3) == 1e-3
    assert factor("ms", "s", "a", never) == 1e-3
    factors._kept.cache_clear()  # as in another process
    assert factor("ms", "s", "a", never) == 1e-3


def test_other_edition_of_the_units_has_a_file_of_its_own(folder: Path) -> None:
    factor("ms", "s", "a", lambda *_: 1e-3)
    assert factor("ms", "s", "b", lambda *_: 2.0) == 2.0


@pytest.mark.parametrize("text", ["", "{", "[1]", '{"ms -> s": "x"}', '{"ms -> s": NaN}'])
def test_damaged_file_is_replaced(folder: Path, text: str) -> None:
    path = folder / "units_a.json"
    path.write_text(text)
    assert factor("ms", "s", "a", lambda *_: 1e-3) == 1e-3
    assert json.loads(path.read_text()) == {"ms -> s": 1e-3}


def test_number_of_factors_on_disk_is_limited(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(factors, "MOST", 3)
    for n in range(5):
        assert factor(f"u{n}", "s", "a", lambda *_: 1.0) == 1.0
    assert len(json.loads((folder / "units_a.json").read_text())) == 3


def test_folder_that_others_may_write_is_not_used(folder: Path) -> None:
    loose = folder / "loose"
    loose.mkdir()
    loose.chmod(0o777)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RTCTL_CACHE_DIR", str(loose))
        assert factor("ms", "s", "a", lambda *_: 1e-3) == 1e-3
    assert not any(loose.iterdir())


def test_errors_are_not_kept(folder: Path) -> None:
    for _ in range(2):
        with pytest.raises(ValueError, match="is not a quantity in s"):
            units.convert.__wrapped__(1.0, "mm", "s")
    assert not any(folder.iterdir())


def test_second_process_converts_without_pint(folder: Path) -> None:
    text = "import sys; from rtctl.config.units import to_si; print(to_si('2.4 mNm', 'N*m'), 'pint' in sys.modules)"
    said = [subprocess.check_output([sys.executable, "-c", text], text=True).split() for _ in range(2)]
    assert said == [["0.0024", "True"], ["0.0024", "False"]]
