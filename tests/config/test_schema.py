import json
import re

import pytest

from rtctl.config.schema import json_schema, settings_table
from rtctl.machines import CONFIGS


@pytest.mark.parametrize("kind", CONFIGS)
def test_every_quantity_accepts_a_number_or_text(kind):
    schema = json_schema(CONFIGS[kind])
    assert schema["$schema"].endswith("2020-12/schema")
    json.dumps(schema, allow_nan=False)
    rate = schema["$defs"]["LoopSettings"]["properties"]["rate"]
    number, text = rate["anyOf"]
    assert (rate["unit"], rate["description"]) == ("Hz", "ticks a second")
    assert (number["type"], number["maximum"], text["type"]) == ("number", 50e3, "string")
    assert re.search(text["pattern"], "500 Hz")
    assert not re.search(text["pattern"], "fast")
    slew = schema["$defs"]["LimitSettings"]["properties"]["slew"]
    assert [part["type"] for part in slew["anyOf"]] == ["number", "null", "string"]


def test_every_reference_of_the_schema_is_defined():
    schema = json_schema(CONFIGS["ldu"])
    names = set(re.findall(r'"#/\$defs/(\w+)"', json.dumps(schema)))
    assert names <= schema["$defs"].keys()


@pytest.mark.parametrize("kind", CONFIGS)
def test_table_has_a_row_for_each_setting_with_help(kind):
    rows = {row.path: row for row in settings_table(CONFIGS[kind])}
    rate = rows["loop.rate"]
    assert (rate.unit, rate.default, rate.bounds) == ("Hz", "", "> 0.1, <= 50000")
    assert rows["loop.mode"].type == "real | lockstep | fused"
    assert rows["reference.steps[].at"].unit == "s"
    assert rows["excitation[sine].frequency"].unit == "Hz"
    assert all(row.help for row in rows.values() if row.unit)


def test_settings_table_shows_the_default_at_its_path():
    rows = {row.path: row for row in settings_table(CONFIGS["ldu"])}
    assert rows["law.limit.high"].default == "3.0"


def test_schema_requires_the_kind_of_a_choice():
    schema = json_schema(CONFIGS["ldu"])
    position = schema["$defs"]["LduLawSettings"]["properties"]["position"]
    assert position["required"] == ["kind"]
    assert schema["$defs"]["LduPlantSettings"]["properties"]["physics"]["items"]["required"] == ["term"]
