"""Kernels of the linear algebra are chosen before numpy is loaded."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from rtctl.config.arithmetic import VARIABLE, equal_digits


@pytest.fixture
def without_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "numpy")
    monkeypatch.setattr("platform.machine", lambda: "x86_64")


def cpu(folder: Path, flags: str) -> Path:
    path = folder / "cpuinfo"
    path.write_text(f"processor\t: 0\nmodel name\t: any\nflags\t\t: {flags}\n\nprocessor\t: 1\n")
    return path


@pytest.mark.parametrize(
    ("flags", "chosen"), [("sse2 avx2 fma avx512f", "Haswell"), ("sse2 avx fma", None), ("avx2", None), ("", None)]
)
def test_kernels_for_avx2_are_chosen_where_the_processor_has_it(
    without_numpy: None, tmp_path: Path, flags: str, chosen: str | None
) -> None:
    environment: dict[str, str] = {}
    equal_digits(environment, cpu(tmp_path, flags))
    assert environment.get(VARIABLE) == chosen


def test_choice_of_the_caller_stays(without_numpy: None, tmp_path: Path) -> None:
    environment = {VARIABLE: "Zen"}
    equal_digits(environment, cpu(tmp_path, "avx2 fma"))
    assert environment[VARIABLE] == "Zen"


def test_other_architecture_and_missing_file_are_left_alone(
    without_numpy: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    environment: dict[str, str] = {}
    equal_digits(environment, tmp_path / "none")
    monkeypatch.setattr("platform.machine", lambda: "aarch64")
    equal_digits(environment, cpu(tmp_path, "avx2 fma"))
    assert not environment


def test_nothing_is_chosen_once_numpy_is_loaded(tmp_path: Path) -> None:
    environment: dict[str, str] = {}
    equal_digits(environment, cpu(tmp_path, "avx2 fma"))
    assert not environment


def test_command_line_chooses_before_it_loads_numpy() -> None:
    """A process of its own, since numpy is loaded here."""
    text = (
        "import os, sys; from rtctl.cli import main; loaded = 'numpy' in sys.modules\n"
        "sys.argv = ['rtctl', '--version']; main.main(); print(loaded, os.environ.get('OPENBLAS_CORETYPE'))"
    )
    said = subprocess.check_output([sys.executable, "-c", text], text=True, env=without(VARIABLE)).split()
    flags = Path("/proc/cpuinfo").read_text()
    assert said[-2:] == ["False", "Haswell" if " avx2" in flags and " fma" in flags else "None"]


def without(name: str) -> dict[str, str]:
    return {key: value for key, value in os.environ.items() if key != name}
