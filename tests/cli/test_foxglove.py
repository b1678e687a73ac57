"""`rtctl foxglove`: refused arguments, and the shipped layouts."""

import json
import re
import sys
from pathlib import Path

import pytest

from rtctl import machines

ROOT = Path(__file__).parents[2]
EXTREMES = {"ivu": False, "ldu": True}  # 10 kHz is thinned


def test_control_is_refused_on_a_network_address(rtctl, runtime):
    code, _, err = rtctl("foxglove", "--host", "0.0.0.0", "--control")
    assert code == 2
    assert "only 127.0.0.1 may be opened with it" in err


def test_foxglove_without_a_running_machine_is_an_error(rtctl, runtime):
    code, _, err = rtctl("foxglove", "nobody")
    assert code == 2
    assert "no machine 'nobody' runs here" in err


def test_foxglove_without_its_package_is_an_error(rtctl, runtime, served, config, monkeypatch):
    machine = served(config("ivu"))
    monkeypatch.setitem(sys.modules, "foxglove", None)
    for name in [name for name in sys.modules if name.startswith("rtctl.foxglove")]:
        monkeypatch.delitem(sys.modules, name)
    code, _, err = rtctl("foxglove", machine.config.name)
    assert code == 2
    assert "pip install 'rtctl[foxglove]'" in err


@pytest.mark.parametrize("kind", ["ivu", "ldu"])
def test_every_path_of_a_layout_is_a_signal(config, kind):
    layout = json.loads((ROOT / f"docs/foxglove/{kind}.json").read_text())
    made = machines.build(config(kind))
    names = {c.name for c in (*made.diagram.columns, *made.truth)}
    paths = re.findall(rf'"(/{kind}[^"]*)"', json.dumps(layout))
    assert len(paths) > 8
    for path in paths:
        topic, _, field = path.partition(".")
        assert topic.removeprefix(f"/{kind}") in ("", "/min", "/max", "/status", "/events")
        if topic == f"/{kind}" or topic.endswith(("/min", "/max")):
            assert field in names, path
    used = set(re.findall(r"[A-Za-z]+![a-z0-9]+", json.dumps(layout["layout"])))
    assert used == set(layout["configById"])
    assert ("/max." in json.dumps(layout)) is EXTREMES[kind]
