"""The layouts in docs/foxglove against Foxglove's own description of its layouts, in the SDK (foxglove.layouts).

`ivu.json` is the form that the app exports, `ivu.v1.json` the one that the SDK writes; both show the same panels.
"""

import json
import typing
from pathlib import Path

import pytest

layouts = pytest.importorskip("foxglove.layouts", reason="foxglove-sdk is not installed")
DOCS = Path(__file__).parents[2] / "docs" / "foxglove"
PANELS = {  # panel name in the app: configuration and series in the SDK
    "Plot": (layouts.PlotConfig, layouts.PlotSeries),
    "StateTransitions": (layouts.StateTransitionsConfig, layouts.StateTransitionsSeries),
    "RosOut": (layouts.LogConfig, None),
    "RawMessages": (layouts.RawMessagesConfig, None),
    "Parameters": (None, None),
}
CALLED = {"RosOut": "Log"}  # panel name in the app -> in the SDK
TITLE = "foxglovePanelTitle"


def read(name):
    return json.loads((DOCS / name).read_text())


def allowed(cls):
    """Key of the file -> allowed values, None for any."""
    hints = typing.get_type_hints(cls)
    found = {}
    for key in cls()._to_dict():
        name = "".join(f"_{c.lower()}" if c.isupper() else c for c in key)
        parts = [a for part in typing.get_args(hints.get(name)) or () for a in (part, *typing.get_args(part))]
        literal = [a for a in parts if isinstance(a, str)]
        found[key] = literal or None
    return found


@pytest.mark.parametrize("machine", ["ivu", "ldu"])
def test_foxglove_knows_every_key_of_a_layout(machine):
    for name, config in read(f"{machine}.json")["configById"].items():
        cls, series = PANELS[name.split("!")[0]]
        known = allowed(cls) if cls else {}
        for key, value in config.items():
            if key == TITLE:
                continue
            assert key in known, (name, key)
            if isinstance(value, str) and known[key]:
                assert value in known[key], (name, key, value)
        for path in config.get("paths", ()):
            keys = allowed(series)
            assert set(path) <= set(keys), (name, path)
            assert path["timestampMethod"] in keys["timestampMethod"]


def panels(content):
    """(type, title, paths) of each panel in SDK form, from left to right."""
    if content["type"] == "panel":
        paths = [path["value"] for path in content.get("config", {}).get("paths", ())]
        return [(content["panelType"], content.get("title"), paths)]
    return [panel for item in content["items"] for panel in panels(item["content"])]


def leaves(layout):
    return [layout] if isinstance(layout, str) else leaves(layout["first"]) + leaves(layout["second"])


@pytest.mark.parametrize("machine", ["ivu", "ldu"])
def test_app_and_sdk_layouts_show_equal_panels(machine):
    app, sdk = read(f"{machine}.json"), read(f"{machine}.v1.json")
    assert sdk["version"] == json.loads(layouts.Layout(content=layouts.ParametersPanel()).to_json())["version"]
    expected = []
    for name in leaves(app["layout"]):
        config = app["configById"][name]
        kind = name.split("!")[0]
        expected.append(
            (CALLED.get(kind, kind), config.get(TITLE), [path["value"] for path in config.get("paths", ())])
        )
    assert panels(sdk["content"]) == expected
