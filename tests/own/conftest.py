"""Fixtures: a small user law for modification, and configs with user files."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

sys.path.insert(0, str(Path(__file__).parent))  # for own_lines.py, under importlib mode
CONFIGS = Path(__file__).parents[2] / "configs"
LAW = '''"""A law for tests."""
from typing import NamedTuple

import numpy as np

from rtctl.idiom import Settings, quantity, state, tick


class TrySettings(Settings):
    gain: float = quantity(unit="V/rad", ge=0, le=100, help="proportional gain")


class TryParams(NamedTuple):
    gain: float


TRY_STATE = state(n=int, x=(float, 3))


def build(settings, dt):
    return TryParams(settings.gain)


def plain(x):
    return x


@tick
def helper(s):
    y = np.zeros(3)
    return y[0]


@tick
def step(p, s, e):
    BODY


@tick
def reset(p, s):
    s.n = 0
'''


@pytest.fixture(autouse=True)
def every_test_leaves_it_as_it_was(library: None) -> None:
    """The library of terms."""


@pytest.fixture
def law() -> Callable[..., str]:
    """`law("return p.gain * e", {"def reset": "def rest"})`: text of the law with another step and replacements."""

    def make(body: str = "return p.gain * e", changes: dict[str, str] | None = None) -> str:
        text = LAW.replace("BODY", body)
        for old, new in (changes or {}).items():
            assert old in text
            text = text.replace(old, new)
        return text

    return make


@pytest.fixture
def config_file(tmp_path: Path) -> Callable[..., Path]:
    """A config of a machine in a separate folder with user files; `position` and `plant` are replaced."""

    def make(kind: str, files: dict[str, str], **parts: Any) -> Path:
        data = yaml.safe_load((CONFIGS / f"{kind}.yaml").read_text())
        data["loop"] |= {"mode": "fused"}
        if "position" in parts:
            data["law"]["position"] = parts["position"]
        if "plant" in parts:
            data["plant"] = parts["plant"]
        for name, text in files.items():
            (tmp_path / name).write_text(text)
        (tmp_path / "config.yaml").write_text(yaml.safe_dump(data, sort_keys=False))
        return tmp_path / "config.yaml"

    return make
