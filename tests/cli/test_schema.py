import json

import pytest


@pytest.mark.parametrize("machine", ["ivu", "ldu", "axis"])
def test_schema_is_json_schema_with_units(rtctl, machine):
    code, out, err = rtctl("schema", machine)
    assert (code, err) == (0, "")
    schema = json.loads(out)
    assert {"name", "machine", "loop", "law", "plant"} <= set(schema["properties"])
    assert '"unit"' in out or "Hz" in out


def test_schema_of_an_unknown_machine_is_an_error(rtctl):
    assert rtctl("schema", "ivy") == (2, "", "rtctl: no machine 'ivy'; did you mean 'ivu'?\n")
