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


def test_values_units_and_bounds_are_those_of_the_config(found):
    ivu, ldu = found("ivu"), found("ldu")
    gain = ivu["law.position.gain"]
    assert (gain["value"], gain["unit"], gain["type"]) == (31.0, "V/rad", "number")
    assert (ldu["law.position.velocity_gain"]["ge"], ldu["law.position.velocity_gain"]["bounds"]) == (0, ">= 0")
    assert (ldu["law.shaper.bandwidth"]["gt"], ldu["law.shaper.bandwidth"]["unit"]) == (0, "rad/s")
    assert ivu["safety.missed_ticks"]["type"] == "integer"
    assert ivu["safety.require_commander"]["type"] == "boolean"
    assert ivu["law.gain_schedule.mode"]["choices"][0] == "off"
    assert ldu["law.limit.slew"]["value"] is None  # not set, and can be


def test_what_changes_the_structure_is_not_offered(found):
    assert not [path for path in found("ldu") if path.endswith(".kind") or not path.startswith(("law.", "safety."))]


def test_a_described_machine_has_its_own_units():
    settings = load_config("spindle", [])
    parts = {part: getattr(settings, part).model_dump(mode="json") for part in ("law", "safety")}
    rows = {row["path"]: row for row in tunable(settings.machine.model_dump(mode="json"), parts)}
    assert (rows["law.position.gain"]["value"], rows["law.position.gain"]["unit"]) == (0.208, "V*s/rad")
    assert rows["law.limit.high"]["unit"] == "V" and rows["law.position.tau_i"]["unit"] == "s"


def test_a_machine_that_this_version_does_not_know_has_none():
    assert tunable("loom", {"law": {"gain": 1.0}}) == []
