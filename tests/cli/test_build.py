import ast

import pytest

from rtctl.cli import build


@pytest.fixture
def compiled(monkeypatch, tmp_path):
    """What would have been compiled; with a cache of our own."""
    monkeypatch.setenv("RTCTL_CACHE_DIR", str(tmp_path))
    calls = []
    monkeypatch.setattr(build, "_compile", lambda machine, link: calls.append((machine.kind, link)))
    return calls


def test_shows_a_module_and_compiles_nothing(rtctl, compiled):
    code, out, err = rtctl("build", "ivu", "--show")
    assert (code, err, compiled) == (0, "", [])
    functions = {node.name for node in ast.parse(out).body if isinstance(node, ast.FunctionDef)}
    assert {"tick", "advance", "run_real", "plant_real"} <= functions


@pytest.mark.parametrize(
    ("words", "link", "entries"),
    [
        (["--mode", "fused"], "shm", "run_fused"),
        (["--mode", "real"], "zmq", "run_real, plant_real"),
        (["--mode", "lockstep", "--link", "shm"], "shm", "run_lockstep, plant_lockstep"),
        (["--set", "link.plant=external", "--set", "link.endpoint=tcp://127.0.0.1:5570"], "zmq", "run_real"),
    ],
)
def test_compiles_what_a_run_needs(rtctl, compiled, tmp_path, words, link, entries):
    code, out, err = rtctl("build", "ldu", *words)
    assert code == 0
    assert compiled == [("ldu", link)]
    assert "compiling" in err
    path, rest = out.strip().split(" ", 1)
    assert path.startswith(str(tmp_path))
    assert rest == f"compiled: {entries}"


def test_another_gain_is_the_same_tick_and_another_law_is_not(rtctl, compiled):
    def path(*words):
        return rtctl("build", "ivu", *words).out.split()[0]

    assert path() == path("--set", "law.position.gain=20")
    assert path() != path("--mode", "fused")


def test_a_mistake_in_the_config_builds_nothing(rtctl, compiled):
    assert rtctl("build", "ivu", "--set", "law.position.gain=much").code == 2
    assert not compiled
