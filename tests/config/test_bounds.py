"""Bounds of changes while running: never less safe than the config at the start or its section `live`."""

import math
import re
from collections.abc import Callable
from typing import Any

import pytest

from rtctl.config.bounds import Bounds, guarded
from rtctl.config.errors import UserError
from rtctl.config.load import get_path, set_path, set_paths

WORSE = [
    ("safety.following_error", 1e9), ("safety.following_error", 0), ("safety.missed_ticks", 0),
    ("safety.missed_ticks", 11), ("safety.link_timeout", "1 min"), ("safety.tension_max", 9.0),
    ("safety.tension_min", -3.0), ("safety.current_time", 0), ("safety.disagreement", "6 mm"), ("safety.ramp", 1.0),
    ("safety.supervisor_timeout", 0), ("law.limit.high", 1000.0), ("law.limit.low", -11.0),
    ("law.tension.amp_per_volt", 0.02),
]  # fmt: skip
BETTER = [
    ("safety.following_error", 0.1), ("safety.missed_ticks", 3), ("safety.tension_min", 0.0), ("law.limit.high", 3.0),
    ("law.limit.low", -3.0), ("safety.require_commander", True), ("law.position.gain", 1e3),
]  # fmt: skip


@pytest.mark.parametrize(("path", "value"), WORSE)
def test_less_safe_value_is_refused_with_a_remedy(config: Callable[..., Any], path: str, value: Any) -> None:
    start = config("ivu")
    sentence = Bounds(start).crossed(set_path(start, path, value))[path]
    assert path in sentence and "live: {" in sentence and "restart" in sentence


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize("path", ["safety.following_error", "law.limit.high", "safety.tension_max"])
def test_nan_and_infinity_cross_every_bound(config: Callable[..., Any], path: str, value: float) -> None:
    start = config("ivu")
    section, name = path.rpartition(".")[::2]
    parent = get_path(start, section).model_copy(update={name: value})  # bypass the validation
    outer, inner = section.rpartition(".")[::2]
    changed = parent if not outer else get_path(start, outer).model_copy(update={inner: parent})
    root = start.model_copy(update={(outer or section): changed})
    assert path in Bounds(start).crossed(root)
    with pytest.raises(UserError, match=re.escape(path)):
        set_path(start, path, value)


@pytest.mark.parametrize("value", ["much", "5 kg", [1], True])
def test_invalid_quantity_is_refused(config: Callable[..., Any], value: Any) -> None:
    with pytest.raises(UserError, match=r"safety\.following_error"):
        set_path(config("ivu"), "safety.following_error", value)


@pytest.mark.parametrize(("path", "value"), BETTER)
def test_safer_value_is_accepted_and_can_be_reverted(config: Callable[..., Any], path: str, value: Any) -> None:
    start = config("ivu")
    bounds = Bounds(start)
    assert bounds.crossed(set_path(start, path, value)) == {}
    assert bounds.crossed(start) == {}


def test_required_commander_stays_required(config: Callable[..., Any]) -> None:
    start = config("ivu", set={"safety.require_commander": True})
    assert Bounds(start).crossed(set_path(start, "safety.require_commander", False))


def test_section_live_widens_only_its_bound(config: Callable[..., Any]) -> None:
    start = config("ivu", set={"live": {"safety.following_error": 1.0}})
    bounds = Bounds(start)
    assert bounds.crossed(set_path(start, "safety.following_error", 1.0)) == {}
    beyond = set_paths(start, {"safety.following_error": 1.1, "safety.missed_ticks": 20})
    assert set(bounds.crossed(beyond)) == {"safety.following_error", "safety.missed_ticks"}


@pytest.mark.parametrize("path", ["law.position.gain", "safety.following_eror"])
def test_section_live_accepts_only_settings_with_a_bound(config: Callable[..., Any], path: str) -> None:
    with pytest.raises(UserError, match=r"live: .* has no bound"):
        Bounds(config("ivu", set={"live": {path: 1.0}}))


@pytest.mark.parametrize("kind", ["ivu", "ldu", "axis"])
def test_every_safety_limit_declares_its_safer_direction(config: Callable[..., Any], kind: str) -> None:
    settings = config(kind)
    said = {g.path for g in guarded(settings)}
    assert {f"safety.{name}" for name in type(settings.safety).model_fields} <= said
    assert {"law.limit.high", "law.limit.low", "law.limit.slew"} <= said
