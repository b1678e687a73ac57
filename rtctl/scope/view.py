"""View of a viewer: signals, kind of plot, window and trigger. The page sends the whole view at each change."""

import json
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rtctl.config.errors import UserError

Name = Annotated[str, Field(max_length=64)]
MOST_SIGNALS = 16
MOST_BYTES = 16 * 1024


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class TriggerView(Part):
    mode: Literal["off", "auto", "normal", "single"] = "off"
    signal: Name = ""
    level: float = 0.0
    edge: Literal["rising", "falling", "either"] = "rising"
    pre: float = Field(default=0.2, ge=0.0, le=1.0)  # fraction of the sweep before the crossing
    armed: int = 0  # a new count starts a new search


class View(Part):
    kind: Literal["time", "xy", "spectrum"] = "time"
    signals: tuple[Name, ...] = Field(default=(), max_length=MOST_SIGNALS)
    x: Name = ""  # x axis of xy; the signals are on the y axis
    window: float = Field(default=5.0, gt=0.0, le=120.0)  # s
    columns: int = Field(default=1000, ge=50, le=4000)
    hold: bool = False
    span: tuple[float, float] | None = None  # s on the shown axis: zoomed part of a held picture
    trigger: TriggerView = TriggerView()


def read_view(data: object, names: tuple[str, ...]) -> View:
    """The view in a message of the page. Raises UserError for an invalid view or an unknown signal."""
    try:
        view = View.model_validate_json(json.dumps(data))
    except (ValidationError, ValueError, TypeError) as error:
        first = error.errors()[0] if isinstance(error, ValidationError) else {"loc": (), "msg": str(error)}
        where = ".".join(str(part) for part in first["loc"])
        raise UserError(f"view {where}: {first['msg']}") from None
    wanted = [*view.signals, *([view.x] if view.kind == "xy" else [])]
    if view.trigger.mode != "off":
        wanted.append(view.trigger.signal)
    for name in wanted:
        if name not in names:
            raise UserError(f"view: there is no signal '{name[:64]}'")
    return view
