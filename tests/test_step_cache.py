"""Cache of compiled steps on disk: found by equal steps of other processes only."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl import sources, step_cache
from rtctl.idiom import Step, tick
from rtctl.laws import pd


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RTCTL_CACHE_DIR", str(tmp_path))
    return tmp_path


@pytest.fixture
def params() -> Any:
    return pd.build(pd.PdSettings(gain=6.2, tau_d=0.16), 0.002)


def call(step: Step, p: Any) -> tuple[list[float], np.ndarray]:
    s = np.zeros(1, pd.PD_STATE)
    return [step(p, s[0], error) for error in (0.1, 0.3, 0.2)], s


def hits(step: Step) -> int:
    return sum(step._outer._cache_hits.values())


def test_cached_step_is_found_and_bit_exact(folder: Path, params: Any) -> None:
    first, again = Step(pd.step.py_func), Step(pd.step.py_func)  # as in two processes
    here = call(first, params)
    assert hits(first) == 0 and any(folder.rglob("step_*"))
    there = call(again, params)
    assert hits(again) == 1
    assert there[0] == here[0] and there[1] == here[1]


def test_other_types_have_another_cache_file(folder: Path, params: Any) -> None:
    call(Step(pd.step.py_func), params)
    kept = set(folder.rglob("step_*"))
    other = Step(pd.step.py_func)
    s = np.zeros(1, pd.PD_STATE)
    other(params, s[0], np.float32(0.1))
    assert hits(other) == 0 and set(folder.rglob("step_*")) > kept


def test_different_types_with_equal_text_are_distinguished(
    folder: Path, params: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(step_cache.StepCache, "_path", lambda *_: folder / "steps" / "one")
    call(Step(pd.step.py_func), params)
    other = Step(pd.step.py_func)
    other(params, np.zeros(1, pd.PD_STATE)[0], np.float32(0.1))
    assert hits(other) == 0


def test_changed_source_has_another_cache_folder(folder: Path, params: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    call(Step(pd.step.py_func), params)
    monkeypatch.setattr(step_cache, "sources_hash", lambda: "f" * 64)
    other = Step(pd.step.py_func)
    call(other, params)
    assert hits(other) == 0 and len(list(folder.glob("steps_*"))) == 2


@pytest.mark.parametrize("damage", [b"", b"\x80\x04damaged", None])
def test_truncated_cache_file_is_compiled_again(folder: Path, params: Any, damage: bytes | None) -> None:
    expected = call(Step(pd.step.py_func), params)
    for path in folder.rglob("step_*"):
        path.write_bytes(path.read_bytes()[:-100] if damage is None else damage)
    other = Step(pd.step.py_func)
    assert call(other, params)[0] == expected[0] and hits(other) == 0
    again = Step(pd.step.py_func)
    assert call(again, params)[0] == expected[0] and hits(again) == 1


def test_unwritable_cache_folder_is_ignored(tmp_path: Path, params: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("RTCTL_CACHE_DIR", str(tmp_path / "file" / "cache"))
    assert len(call(Step(pd.step.py_func), params)[0]) == 3


def test_foreign_or_closure_steps_are_not_cached(folder: Path) -> None:
    def made(factor: float) -> Step:
        @tick
        def scaled(x: float) -> float:
            return factor * x

        return scaled

    assert made(2.0)(3.0) == 6.0 and made(3.0)(3.0) == 9.0
    assert not any(folder.rglob("scaled_*"))
    assert step_cache.is_kept(pd.step.py_func)
    assert not step_cache.is_kept(test_changed_source_has_another_cache_folder)


def test_every_step_of_the_library_is_in_the_hash() -> None:
    names = {path.name for path in sources.files()}
    assert {"pd.py", "l292.py", "friction.py", "runner.py", "idiom.py", "step_cache.py"} <= names
    assert not {"chain.py", "main.py", "prove.py"} & names


LOAD = """
import importlib.util, sys
from numba import float64
from rtctl.idiom import entry
spec = importlib.util.spec_from_file_location("made", sys.argv[1])
made = sys.modules["made"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(made)
made.twice.compile((float64,))
print(made.twice(2.5), sum(made.twice._cache_hits.values()), "numba.np.linalg" in sys.modules)
made.thrice.compile((float64,))
print(made.thrice(2.5))
"""


def test_cached_entry_point_is_loaded_without_the_registries_of_the_compiler(tmp_path: Path) -> None:
    """And a compilation after it fills them."""
    text = "from rtctl.idiom import entry\n\n\n@entry\ndef twice(x):\n    return 2.0 * x\n"
    path = tmp_path / "made.py"
    path.write_text(text + "\n\nthrice = entry(lambda x: 3.0 * x)\n")
    said = [subprocess.check_output([sys.executable, "-c", LOAD, path], text=True).split() for _ in range(2)]
    assert said == [["5.0", "0", "True", "7.5"], ["5.0", "1", "False", "7.5"]]
