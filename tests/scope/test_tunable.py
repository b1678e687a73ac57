import pytest

from rtctl.cli.common import load_config
from rtctl.scope.tunable import tunable


@pytest.fixture
def found(config):
    def rows(kind):
        settings = config(kind)
        parts = {part: getattr(settings, part).model_dump(mode="json") for part in ("law", "safety")}
        return {row["path"]: row for row in tunable(kind, parts)}

    return rows


def test_tunable_settings_have_values_units_and_bounds_of_the_config(found):
    ivu, ldu = found("ivu"), found("ldu")
    gain = ivu["law.position.gain"]
    assert (gain["value"], gain["unit"], gain["type"]) == (31.0, "V/rad", "number")
    assert (ldu["law.position.velocity_gain"]["ge"], ldu["law.position.velocity_gain"]["bounds"]) == (0, ">= 0")
    assert (ldu["law.shaper.bandwidth"]["gt"], ldu["law.shaper.bandwidth"]["unit"]) == (0, "rad/s")
    assert ivu["safety.missed_ticks"]["type"] == "integer"
    assert ivu["safety.require_commander"]["type"] == "boolean"
    assert ivu["law.gain_schedule.mode"]["choices"][0] == "off"
    assert ldu["law.limit.slew"]["value"] is None  # unset but settable


def test_structural_settings_are_not_tunable(found):
    assert not [path for path in found("ldu") if path.endswith(".kind") or not path.startswith(("law.", "safety."))]


def test_described_machine_has_the_units_of_its_description():
    settings = load_config("spindle", [])
    parts = {part: getattr(settings, part).model_dump(mode="json") for part in ("law", "safety")}
    rows = {row["path"]: row for row in tunable(settings.machine.model_dump(mode="json"), parts)}
    assert (rows["law.position.gain"]["value"], rows["law.position.gain"]["unit"]) == (0.208, "V*s/rad")
    assert rows["law.limit.high"]["unit"] == "V" and rows["law.position.tau_i"]["unit"] == "s"


def test_unknown_machine_has_no_tunable_settings():
    assert tunable("loom", {"law": {"gain": 1.0}}) == []
