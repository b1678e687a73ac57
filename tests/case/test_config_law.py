"""Law from the config of a rtctl recording, and the parts that a diagnosis does not simulate."""

from typing import Any

import pytest

from rtctl.case.config_law import ConfigLaw, UnsaidLaw, config_law
from rtctl.machines.axis import AxisConfig

PI = {"kind": "pi_velocity", "gain": 6400.0}


def config(machine: str, law: dict[str, Any], **parts: Any) -> dict[str, Any]:
    return {"name": "it", "machine": machine, "loop": {"rate": 1000.0}, "law": law, **parts}


def test_law_of_each_shipped_machine_is_known():
    law = config_law(config("axis", {"position": PI, "shaper": {"bandwidth": 20.0}}))
    assert isinstance(law, ConfigLaw) and law.kind == "pi_velocity" and isinstance(law.config, AxisConfig)
    assert isinstance(config_law(config("ldu", {"position": {"kind": "sections", "sections": []}})), ConfigLaw)
    law = config_law(config("ivu", {"position": {"gain": 31.0}, "gain_schedule": {"mode": "model"}}))
    assert isinstance(law, ConfigLaw) and law.kind == "pd"


@pytest.mark.parametrize(
    ("machine", "law", "parts", "word"),
    [
        ("ldu", {"position": PI}, {"sensors": {"feedback": "scale"}}, "scale"),
        ("ldu", {"position": PI}, {"sensors": {"correction": {"period": 0.02, "values": [0.0, 1e-6]}}}, "error table"),
        ("ldu", {"position": PI}, {"plant": {"amplifier": {"kind": "measured"}}}, "amplifier"),
        ("axis", {"position": {"kind": "./my_law.py:MyLaw", "gain": 1.0}}, {}, "own file, ./my_law.py:MyLaw"),
    ],
)
def test_parts_that_are_not_simulated_are_reported(machine, law, parts, word):
    found = config_law(config(machine, law, **parts))
    assert isinstance(found, UnsaidLaw) and len(found.parts) == 1
    assert word in found.parts[0]


@pytest.mark.parametrize("given", [None, {}, {"machine": "lathe"}, config("axis", {"position": {"kind": "of later"}})])
def test_unreadable_config_gives_no_law(given):
    assert config_law(given) is None
