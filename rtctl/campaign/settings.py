"""Settings of a campaign file and of its axes.

campaign: radii
config: ivu
set: {law.shaper.bandwidth: 8 rad/s}
matrix:
  loop.seed: {range: [1, 400]}
  radii:
    together:
      R1: {paths: [radius.R1, plant.parameters.R1], values: [38 mm, 30 mm]}
      R2: {paths: [radius.R2, plant.parameters.R2], values: [22 mm, 32 mm]}
"""

from typing import Any, Literal

from pydantic import Field, model_validator

from rtctl.campaign.metrics import METRICS
from rtctl.config.errors import nearest
from rtctl.idiom import Settings, quantity

MOST_VALUES = 100_000  # most values of an axis


def _check_metric(name: str, key: str) -> None:
    if name not in METRICS:
        near = nearest(name, METRICS)
        hint = f"did you mean '{near}'?" if near else f"there is {', '.join(METRICS)}"
        raise ValueError(f"{key}: no metric '{name[:40]}'; {hint}")


class KeepSettings(Settings):
    """Runs that get a bundle, written by a second run: virtual time reproduces the rows."""

    bundles: Literal["some", "all", "none"] = Field(default="some", description="some: the two numbers below")
    worst: int = Field(default=5, ge=0, le=1000, description="bundles of the runs with the largest `by`")
    by: str = Field(default="final_error_mm", description="metric that selects the worst runs")
    failures: int = Field(default=20, ge=0, le=1000, description="bundles of runs that tripped, at most")

    @model_validator(mode="after")
    def _known(self) -> "KeepSettings":
        _check_metric(self.by, "by")
        return self


class AxisSettings(Settings):
    """Axis of the matrix. Its key is the dotted path of a setting, or a name where `paths` or `together` are given.

    Exactly one of `values`, `range`, `linspace`, `random` and `together`.
    """

    paths: list[str] = Field(default=[], description="dotted paths that all take the same value; the key if absent")
    values: list[Any] | dict[str, Any] | None = Field(default=None, description="values, or values by their labels")
    range: list[Any] | None = Field(default=None, min_length=2, max_length=3, description="first, last and step (1)")
    linspace: list[Any] | None = Field(
        default=None, min_length=3, max_length=3, description="first, last and how many, equally spaced"
    )
    random: list[Any] | None = Field(
        default=None, min_length=2, max_length=2, description="lowest and highest; `count` of them, equally likely"
    )
    count: int | None = Field(default=None, ge=1, le=MOST_VALUES, description="how many random values")
    seed: int | None = Field(default=None, ge=0, description="seed of the random values")
    together: dict[str, Any] | None = Field(
        default=None, description="axes of equal length that step together, by their names"
    )

    @model_validator(mode="after")
    def _one_source(self) -> "AxisSettings":
        sources = ("values", "range", "linspace", "random", "together")
        given = [name for name in sources if getattr(self, name) is not None]
        if len(given) != 1:
            has = " and ".join(given) if given else "none"
            raise ValueError(f"an axis needs exactly one of {', '.join(sources)}; it has {has}")
        if self.random is not None and (self.count is None or self.seed is None):
            raise ValueError("random needs `count` and `seed`, so that everybody draws the same")
        if self.random is None and (self.count is not None or self.seed is not None):
            raise ValueError("`count` and `seed` go with `random` only")
        if self.together is not None and self.paths:
            raise ValueError("`paths` go into the axes of `together`")
        return self


class CampaignSettings(Settings):
    """A campaign file."""

    campaign: str = Field(pattern=r"^[A-Za-z0-9_.-]{1,60}$", description="name of the campaign")
    config: str = Field(description="config of the machine: a file, or the name of one that comes with rtctl")
    reference: str | None = Field(default=None, description="file of a reference to play instead of the config's own")
    set: dict[str, Any] = Field(default={}, description="dotted path of a setting -> its value in all runs")
    matrix: dict[str, Any] = Field(default={}, description="axes; every combination is a run, the last axis fastest")
    seconds: float | None = quantity(
        None, unit="s", gt=0, help="length of a run from the first tick; its reference and 2 s more if absent"
    )
    trips: Literal["fail", "result"] = Field(
        default="fail", description="whether a trip fails the run, or is what the campaign is about"
    )
    metrics: list[str] = Field(default=[], description="metrics in the table; all of the machine's if absent")
    keep: KeepSettings = KeepSettings()

    @model_validator(mode="after")
    def _known(self) -> "CampaignSettings":
        for i, name in enumerate(self.metrics):
            _check_metric(name, f"metrics.{i}")
        if self.metrics and self.keep.by not in self.metrics:
            raise ValueError(f"metrics: `keep.by` is {self.keep.by}, which is not among them")
        return self
