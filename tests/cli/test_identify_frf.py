"""`rtctl identify frf | multisine | fit` on an emulated machine and on its recordings."""

import json
import os
import subprocess
import sys

import pytest

SHORT = ["--averages", "8", "--rms", "1V"]


@pytest.fixture(scope="module")
def bundles(tmp_path_factory):
    """Bundles of two realisations."""
    from rtctl.cli import identify_source
    from rtctl.cli.common import load_config
    from rtctl.identify import experiment

    config = load_config("ivu", [f"name=frf-{os.getpid()}"])
    out = tmp_path_factory.mktemp("runs")
    plan = experiment.multisine(config, realisations=2, periods=2)
    identify_source.play(config, plan, out, lambda _: None)
    return [str(path) for path in sorted(out.iterdir())]


def test_identify_frf_of_an_emulated_machine(rtctl, tmp_path):
    picture = tmp_path / "frf.png"
    code, out, err = rtctl("identify", "frf", "ivu", *SHORT, "--plot", picture)
    assert code == 0
    assert "averages, H_p carried at" in out and "coherence" in out
    assert "playing 1 of 1" in err
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_frf_per_ampere_as_json(rtctl):
    code, out, err = rtctl("identify", "frf", "ivu", *SHORT, "--per-ampere", "--json")
    found = json.loads(out)
    assert code == 0 and err == ""
    assert found["frf"]["unit"] == "rad/A"
    assert len(found["f"]) == len(found["coherence"]) == len(found["S"]["re"])


def test_multisine_frf_from_recorded_realisations(rtctl, bundles):
    code, out, _ = rtctl("identify", "multisine", *bundles)
    assert code == 0
    assert out.startswith("2 realisations of 4 periods")
    code, out, _ = rtctl("identify", "multisine", *bundles, "--json")
    assert json.loads(out)["frf"]["motor"] == 1


def test_fit_from_recordings(rtctl, bundles):
    code, out, _ = rtctl("identify", "fit", *bundles, "--json")
    found = json.loads(out)["parameters"]
    assert code == 0
    assert set(found) == {"J_m", "c", "k", "c_m", "k_m", "tau", "K_p"}
    assert found["J_m"]["value"] == pytest.approx(1.5e-3, rel=0.05)
    code, out, _ = rtctl("identify", "fit", *bundles, "--free", "J_m", "--free", "c", "--model", "ivu")
    assert code == 0 and "95 % from" in out


def test_insufficient_data_is_exit_code_3(rtctl, bundles):
    code, out, err = rtctl("identify", "multisine", bundles[0])
    assert (code, out) == (3, "") and "at least two" in err
    code, out, err = rtctl("identify", "frf", "ivu", *SHORT, "--band", "1:200")
    assert (code, out) == (3, "") and "too inaccurate from" in err


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["frfs"], "did you mean 'frf'?"),
        (["frf", "axis"], "not on axis"),
        (["frf", "ivu", "--band", "60"], "write the ends in Hz with a colon"),
        (["frf", "ivu", "--rms", "2kg"], "--rms 2kg"),
        (["frf", "ivu", "--rms", "5V"], "take 1.2 V or less"),
        (["frf", "ivu", "ldu"], "is not a folder"),
    ],
)
def test_invalid_arguments_are_refused(rtctl, arguments, said):
    code, out, err = rtctl("identify", *arguments)
    assert (code, out) == (2, "")
    assert said in err


def test_config_options_are_refused_with_recordings(rtctl, bundles):
    code, _, err = rtctl("identify", "multisine", *bundles, "--set", "loop.seed=2")
    assert code == 2 and "goes with a CONFIG" in err


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from rtctl.cli import main; "
        "main.main(['identify', 'fit', '--help']); print('numpy' in sys.modules, 'numba' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False False"
