"""Remedy: its effect, its settings, and the result of its trial."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from rtctl.design.margins import Margins
from rtctl.improve.played import Figures

BASE = "law.compensation"


class Remedy(NamedTuple):
    """A proposal. Each of its `ways` is tried, and the best is kept."""

    kind: str  # of plants/physics/term.py, or a kind that belongs to the law
    title: str
    against: str  # effect, or part of the machine
    size: str  # with interval, or the rule by which it was sized
    ways: tuple[Mapping[str, Any], ...]  # path of the config -> value
    note: str = ""  # condition on the machine


class Tried(NamedTuple):
    """A remedy and the result of its check on the emulated fitted model."""

    remedy: Remedy
    values: Mapping[str, Any]  # of the way that was kept; empty where the remedy is left out
    before: float  # rms of the tracking error without it
    after: float  # with it
    reason: str  # for leaving it out, "" where it is kept
    figures: Figures | None
    margins: Margins | None

    @property
    def kept(self) -> bool:
        """Whether it is part of the improved config."""
        return not self.reason


def neutral(effects: tuple[Any, ...], feedforward: bool, inverse: bool, table: bool) -> dict[str, Any]:
    """Neutral compensation of every kind, so that trials differ in numbers alone and compile once."""
    made: dict[str, Any] = {
        "integral": {"gain": 0.0},
        "observer": {"bandwidth": 1.0, "acceleration": 1.0, "share": 0.0},
        "filter": {"sections": []},
    }
    if feedforward:
        made["feedforward"] = {
            "inertia": 0.0, "friction": 0.0, "viscous": 0.0, "velocity": 0.0,
            "effects": [{"effect": effect, "share": 0.0} for effect in effects],
        }  # fmt: skip
    if inverse:
        made["inverse"] = {"points": [(-1.0, -1.0), (1.0, 1.0)]}
    if table:
        made["correction"] = {"period": 1.0, "values": [0.0, 0.0]}
    return made


def written(values: Mapping[str, Any], effects: list[dict[str, Any]]) -> dict[str, Any]:
    """Settings of the improved config: compensation with an effect, and the other changed keys."""
    made: dict[str, Any] = {}
    others: dict[str, Any] = {}
    for path, value in values.items():
        if not path.startswith(f"{BASE}."):
            others[path] = value
            continue
        *outer, last = path.removeprefix(f"{BASE}.").split(".")
        node = made
        for key in outer:
            node = node.setdefault(key, {})
        node[last] = value
    feedforward = made.get("feedforward")
    if feedforward is not None:
        shares = feedforward.pop("effects", {})
        kept = [
            {"effect": effects[int(i)], "share": share["share"]}
            for i, share in sorted(shares.items())
            if share["share"]
        ]
        for key in ("inertia", "friction", "viscous", "velocity"):
            feedforward.setdefault(key, 0.0)
        feedforward |= {"effects": kept} if kept else {}
    return {**others, **({BASE: made} if made else {})}
