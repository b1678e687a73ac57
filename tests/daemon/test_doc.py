"""docs/protocol.md agrees with the code: ops, error codes, limits, and examples that run."""

import re
import threading
from pathlib import Path

import numpy as np
import pytest

from rtctl.daemon import protocol
from rtctl.daemon.rows import RowsOut
from rtctl.daemon.server import default_endpoint
from rtctl.daemon.telemetry import Telemetry

DOC = (Path(__file__).parents[2] / "docs/protocol.md").read_text()
EXAMPLES = re.findall(r"```python\n(.*?)```", DOC, re.DOTALL)


def table(title):
    """The rows of the first table under a heading, as lists of cells."""
    section = DOC.split(f"## {title}\n")[1].split("\n## ")[0]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in section.splitlines() if line[:3] == "| `"]


def test_documented_ops_and_arguments_are_those_of_the_code():
    rows = {cells[0].strip("`"): cells[1] for cells in table("Ops")}
    assert list(rows) == list(protocol.OPS)
    for op, model in protocol.OPS.items():
        for name, field in model.model_fields.items():
            assert (f"[`{name}`]" in rows[op]) is not field.is_required()
            assert f"`{name}`" in rows[op]
        assert rows[op].count("`") == 2 * len(model.model_fields)


def test_documented_error_codes_are_those_of_the_code():
    assert [cells[0].strip("`") for cells in table("Error codes")] == list(protocol.ERRORS)


def test_documented_limits_are_those_of_the_code():
    assert f"{protocol.MAX_BYTES // 1024} KiB; over" in DOC
    assert f"| nesting | {protocol.MAX_DEPTH} levels |" in DOC
    assert f"| text | {protocol.LIMITS['max_str_len'] // 1024} KiB;" in DOC
    assert f"| list | {protocol.LIMITS['max_array_len']} items |" in DOC
    assert f"| map | {protocol.LIMITS['max_map_len']} keys |" in DOC
    assert f"This is version {protocol.VERSION}." in DOC


@pytest.mark.parametrize("code", EXAMPLES, ids=range(len(EXAMPLES)))
def test_documented_examples_run(code, serving, context, monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    done = threading.Event()
    telemetry = Telemetry(default_endpoint("ivu", "telemetry"), "ivu", ["v"], context)
    rows = RowsOut(default_endpoint("ivu", "rows"), "ivu", np.dtype([("t", float)]), context)

    def publish():
        while not done.wait(0.01):
            telemetry.publish(np.array([[1.5, 0.25]]))
            rows.publish(np.array([(2.5,)], [("t", float)]))

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        with serving(default_endpoint("ivu", "command")):
            exec(compile(code, "docs/protocol.md", "exec"), {})
    finally:
        done.set()
        thread.join()
    out = capsys.readouterr().out
    if "status" in code:
        assert "'op': 'status'" in out
    if '"rows"' in code:
        assert out.endswith("[2.5]\n")
    elif "SUB" in code:
        assert "1.5 {'timestamp': 1.5, 'v': 0.25}" in out
    if "REQ" in code:
        assert "tension.gain" in out
