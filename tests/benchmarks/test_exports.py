"""Benchmark of exports on a recording of one second."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "exports.py"


def test_size_of_each_format_is_relative_to_json():
    command = [sys.executable, str(SCRIPT), "--json", "--minutes", "0.02", "--to", "mcap-json,mcap"]
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert found["rows"] == 12000 and set(found["exports"]) == {"mcap", "mcap-json"}
    assert found["exports"]["mcap-json"]["share"] == 1.0 and found["exports"]["mcap"]["megabytes"] > 0
