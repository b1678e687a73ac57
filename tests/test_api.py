"""Public names of the package."""

import subprocess
import sys

import numpy as np
import pytest

import rtctl


def test_every_public_name_exists_and_is_documented():
    for name in rtctl.__all__:
        assert getattr(rtctl, name).__doc__, name
    assert set(rtctl.__all__) == set(rtctl._WHERE) and set(rtctl.__all__) <= set(dir(rtctl))


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'rnu'"):
        _ = rtctl.rnu  # type: ignore[attr-defined]


def test_import_loads_nothing_heavy():
    code = "import sys, rtctl; print([m for m in ('numpy', 'numba', 'pydantic', 'zmq') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-S", "-c", code], capture_output=True, text=True, env={"PYTHONPATH": PATH})
    assert (done.stdout, done.stderr) == ("[]\n", "")


PATH = str(__import__("pathlib").Path(rtctl.__file__).parents[1])


def test_run_and_steps():
    config = rtctl.load_config("ivu", {"law.position.gain": "25 V/rad"}, reference="steps")
    assert (config.law.position.gain, config.loop.mode) == (25.0, "real")
    run = rtctl.run(config, 4.0)
    assert (run["capstan"].shape, run.tripped) == ((2000,), "")
    (step,) = rtctl.steps(run)
    assert step["size"] == 1.0 and 0.0 < abs(step["final_error_mm"]) < 0.2
    assert rtctl.change(config, {"law.position.gain": np.float64(20.0)}).law.position.gain == 20.0


def test_record_compare_and_replay(tmp_path):
    config = rtctl.load_config("ivu", {"loop.mode": "fused"}, reference="steps")
    bundle = rtctl.record(config, 2.0, tmp_path / "a")
    again = rtctl.load_bundle(tmp_path / "a")
    assert len(again.columns["t"]) == 1000 == len(bundle.columns["t"])
    assert not rtctl.compare(bundle, tmp_path / "a").different
    assert rtctl.replay(tmp_path / "a").identical
    assert [s["t"] for s in rtctl.steps(bundle)] == [s["t"] for s in rtctl.steps(tmp_path / "a")]


def test_invalid_arguments_are_user_errors(tmp_path):
    with pytest.raises(rtctl.UserError, match="did you mean 'gain'"):
        rtctl.load_config("ivu", {"law.position.gian": 3})
    with pytest.raises(rtctl.UserError, match="not a folder"):
        rtctl.steps(tmp_path / "none")
