"""A short fuzz run of every target, and hypothesis on the same readers. `benchmarks/fuzz.py` is the long run."""

import json
import subprocess
import sys
from pathlib import Path

import msgpack
import pytest
from harness import run
from hypothesis import given, settings
from hypothesis import strategies as st
from messages import REQUESTS
from readers import CASE, UNITS
from targets import TARGETS

INPUTS = {"request": 4000, "reply": 4000, "frame": 3000, "telemetry": 3000, "unit": 2000, "trigger": 2000, "repair": 60}
LEAVES = st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text(max_size=40)
TREES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner, max_size=4)
)


@pytest.mark.parametrize("name", TARGETS)
def test_fuzz_run_of_a_target_has_no_findings(name):
    outcome = run(name, TARGETS[name], INPUTS.get(name, 400), seed=2, patience=60.0)
    assert [(finding.what, finding.input[:300]) for finding in outcome.findings] == []
    assert outcome.inputs == INPUTS.get(name, 400)


@pytest.fixture(scope="module", params=["request", "reply", "trigger", "unit", "yaml", "case"])
def target(request, tmp_path_factory):
    return TARGETS[request.param].make(tmp_path_factory.mktemp("target"))


@settings(deadline=None, max_examples=60)
@given(
    st.binary(max_size=200)
    | st.text(max_size=60).map(str.encode)
    | TREES.map(msgpack.packb)
    | TREES.map(lambda tree: json.dumps(tree).encode())
    | st.sampled_from(UNITS).flatmap(lambda unit: st.text(max_size=9).map(lambda text: (unit + text).encode()))
)
def test_hypothesis_finds_no_failing_input(target, data):
    target.feed(data)


@settings(deadline=None, max_examples=60)
@given(op=st.sampled_from(REQUESTS), args=st.dictionaries(st.sampled_from(["value", "path", "unit", "seconds"]), TREES))
def test_plausible_requests_with_random_arguments(tmp_path_factory, op, args):
    feed = TARGETS["request"].make(tmp_path_factory.getbasetemp()).feed
    feed(msgpack.packb({**msgpack.unpackb(op), "args": args}))


@settings(deadline=None, max_examples=60)
@given(key=st.sampled_from(sorted(CASE)), value=TREES)
def test_case_with_one_random_value(tmp_path_factory, key, value):
    feed = TARGETS["case"].make(tmp_path_factory.mktemp("case", numbered=True)).feed
    feed(json.dumps({**CASE, key: value}).encode())


def test_fuzz_program_counts_its_inputs_and_findings(tmp_path):
    program = Path(__file__).parents[2] / "benchmarks" / "fuzz.py"
    words = [sys.executable, program, "--json", "--inputs", "300", "--target", "request", "--target", "reply"]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    told = json.loads(done.stdout)
    assert (done.returncode, told["inputs"], told["findings"]) == (0, 300, [])
    assert set(told["targets"]) == {"request", "reply"} and told["targets"]["request"]["inputs"] == 200
