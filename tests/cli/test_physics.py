import subprocess
import sys

import numpy as np
import pytest

from rtctl.plants.physics import TERMS, anywhere, by_kind
from rtctl.plants.physics.portrait import Curve


@pytest.fixture
def quick(monkeypatch):
    """Stubbed curves that need no compilation; tests/plants/physics/test_portrait.py draws the true curves."""

    def draw(term):
        x = np.linspace(0.0, 1.0, 200)
        kind, nodes = next(iter(anywhere(term).items()))
        settings = term.settings.model_construct(term=term.name, node=nodes[0])
        return Curve(x, np.sin(9 * x), 0 * x, "speed, m/s", "drag, N", settings, kind)

    monkeypatch.setattr("rtctl.plants.physics.portrait.portrait", draw)


def test_physics_lists_every_term(rtctl):
    code, out, _ = rtctl("physics")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(TERMS)


@pytest.mark.parametrize("name", TERMS)
def test_physics_explains_a_term(rtctl, quick, name):
    code, out, _ = rtctl("physics", name)
    term, said = TERMS[name], " ".join(out.split())
    assert code == 0
    for text in (
        term.words,
        term.equation,
        term.source,
        *by_kind(term),
        term.check,
        *term.look_alikes.values(),
    ):
        assert " ".join(text.split()) in said
    for parameter in set(term.settings.model_fields) - {"term", "node"}:
        assert f"{parameter} " in out
    assert "drag, N" in out and "speed, m/s" in out and "drawn at" in out


@pytest.mark.parametrize("wrong", ["friction.stribek", "stribeck"])
def test_unknown_term_is_an_error(rtctl, wrong):
    code, out, err = rtctl("physics", wrong)
    assert (code, out) == (2, "")
    assert "did you mean 'friction.stribeck'?" in err


def test_curve_has_the_axes_and_parameters_of_its_term(rtctl, tmp_path):
    path = tmp_path / "dead.png"
    code, out, _ = rtctl("physics", "drive.deadband", "--plot", path)
    assert code == 0
    assert "at the motor, V" in out and "command, V" in out and "with band 0.063" in out
    assert path.read_bytes().startswith(b"\x89PNG")


def test_terminal_without_braille_gets_ascii_characters():
    code = "import sys; from rtctl.cli.main import main; sys.exit(main(['physics', 'drive.offset']))"
    ascii_only = {"PYTHONIOENCODING": "ascii", "PATH": "/usr/bin:/bin"}
    done = subprocess.run([sys.executable, "-c", code], env=ascii_only, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "*" in done.stdout and done.stdout.isascii()


@pytest.mark.parametrize(
    "arguments, said", [(["--plot", "x.png"], "say which"), (["drive.lag", "--plot", "x.pdf"], "name it x.png")]
)
def test_plot_without_a_term_or_of_another_format_is_refused(rtctl, arguments, said):
    code, out, err = rtctl("physics", *arguments)
    assert (code, out) == (2, "")
    assert said in err


def test_physics_list_imports_nothing_heavy():
    code = "import sys; from rtctl.cli.main import main; main(['physics']); print('matplotlib' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False"
