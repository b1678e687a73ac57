"""Machines with mechanics from a file on the command line: new, check, import, and trusted code."""

import json
import shutil

import numpy as np
import pytest
from coupled_machines import FOLDER

from rtctl.config.errors import UserError
from rtctl.plants.graph import mechanics


@pytest.fixture(autouse=True)
def _no_known_mechanics(runtime, monkeypatch):
    """State of a new process: no mechanics file is known."""
    monkeypatch.setattr(mechanics, "_known", {})
    monkeypatch.setattr(mechanics, "_given", {})


@pytest.fixture
def mine(rtctl, tmp_path):
    """A new machine and its mechanics file."""
    code, _, err = rtctl("new", "machine", "mine.yaml", "--like", "furuta", "--into", tmp_path)
    assert (code, err) == (0, "")
    return tmp_path / "mine.yaml"


def test_new_writes_the_mechanics_file_next_to_the_config(rtctl, mine):
    beside = mine.parent / "furuta.py"
    assert beside.read_text() == (FOLDER / "furuta.py").read_text()
    assert rtctl("new", "machine", "second.yaml", "--like", "furuta", "--into", mine.parent)[0] == 0
    beside.write_text("# mine\n")
    code, _, err = rtctl("new", "machine", "third.yaml", "--like", "furuta", "--into", mine.parent)
    assert code == 2 and "furuta.py: there already, with another text" in err
    assert beside.read_text() == "# mine\n" and not (mine.parent / "third.yaml").exists()


def test_check_prints_which_drive_moves_which_coordinate(rtctl, mine):
    code, out, err = rtctl("check", mine)
    assert (code, err) == (0, "")
    for words in ("./furuta.py:Furuta moves arm and pendulum by each other", "m 0.024 kg", "2.275 Hz, damping 0.0227"):
        assert words in out


@pytest.mark.parametrize(("old", "new", "words"), [
    ("    out[1, 1] = pendulum\n", "    out[1, 0] = 0.0\n    out[1, 1] = pendulum\n",
     "M is not symmetric: out[0, 1] is"),
    ("    out[1, 0] = out[0, 1]\n", "    out[1, 0] = p.mass\n", "furuta.py:50: AttributeError"),
    ("@tick\ndef M(", "def M(", "M is not compiled; write @tick above it"),
    ("def h(p, J, q, v, out)", "def h(p, q, v, out)", "h(p, q, v, out) should be @tick def h(p, J, q, v, out)"),
    ('COORDINATES = ("arm", "pendulum")', 'COORDINATES = ("arm", "rod")', "there is no body 'rod'"),
    ("import math\n", "import math\n1 / 0\n", "furuta.py:15: ZeroDivisionError"),
])  # fmt: skip
def test_check_reports_the_error_of_an_invalid_mechanics_file(rtctl, mine, old, new, words):
    file = mine.parent / "furuta.py"
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new, 1))
    code, _, err = rtctl("check", mine)
    assert code == 2 and words in err


@pytest.mark.parametrize(("old", "new", "words"), [
    ("m: 24 g", "m: 24 mm", "mechanics.parameters.m"), ("m: 24 g, ", "", "mechanics.parameters: m: is missing"),
    ("m: 24 g", "mass: 24 g", "it has m, r, d"),
    ("./furuta.py:Furuta", "./furuto.py:Furuta", "did you mean 'furuta.py'"),
    ("pendulum: 0 deg", "pendulum: 0 kg", "mechanics.at.pendulum"),
    ("pendulum: 0 deg", "rod: 0 deg", "mechanics.at.rod"),
])  # fmt: skip
def test_check_reports_a_config_that_does_not_fit_the_mechanics(rtctl, mine, old, new, words):
    assert old in mine.read_text()
    mine.write_text(mine.read_text().replace(old, new, 1))
    code, _, err = rtctl("check", mine)
    assert code == 2 and words in err


def test_code_from_a_bundle_is_never_run(rtctl, mine, tmp_path, monkeypatch):
    """Code in the case of a bundle is never run; only a path on the command line names code."""
    log, bundle = tmp_path / "log.csv", tmp_path / "bundle"
    wave = np.round(np.sin(np.arange(1000) * 0.01), 6)
    rows = np.stack([np.arange(1000) * 1e-3, wave, np.floor(100 * wave), np.floor(90 * wave)], axis=1)
    np.savetxt(log, rows, delimiter=",", header="t,u,arm_counts,pendulum_counts", comments="")
    code, out, err = rtctl("import", log, "--machine", mine, "--out", bundle)
    assert code == 0 and "diagnose would say" not in out
    case = json.loads((bundle / "case.json").read_text())
    assert case["machine"]["mechanics"]["kind"] == "./furuta.py:Furuta"
    assert "def M" not in json.dumps(case)
    case["config"] = {"own": {"./furuta.py": "raise SystemExit(7)"}}
    (bundle / "case.json").write_text(json.dumps(case))
    shutil.copy(mine.parent / "furuta.py", bundle)
    monkeypatch.setattr(mechanics, "_known", {})
    monkeypatch.setattr(mechanics, "_given", {})
    code, _, err = rtctl("diagnose", bundle)
    assert code == 2 and "no code is taken from a bundle" in err and "--mechanics ./furuta.py" in err
    code, _, err = rtctl("diagnose", bundle, "--mechanics", tmp_path / "none.py")
    assert code == 2 and "no such file" in err

    def reached(folder, *_):
        from rtctl.case.format2 import read_case

        case = read_case(json.loads((folder / "case.json").read_text()), folder)
        raise UserError(f"{case.layout.nq} coordinates")

    monkeypatch.setattr("rtctl.diagnose.bundles.diagnose_into", reached)
    for option, value in (("--mechanics", mine.parent / "furuta.py"), ("--machine", mine)):
        code, _, err = rtctl("diagnose", bundle, option, value)
        assert code == 2 and "2 coordinates" in err
