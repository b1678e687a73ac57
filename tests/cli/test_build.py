import ast

import pytest

from rtctl.cli import build


@pytest.fixture
def compiled(monkeypatch, tmp_path):
    """List of requested compilations; the cache is a temporary folder."""
    monkeypatch.setenv("RTCTL_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)  # it may hold the tick compiled by another test
    calls = []
    monkeypatch.setattr(build, "_compile", lambda machine, link: calls.append((machine.kind, link)))
    return calls


def test_build_show_prints_the_module_and_compiles_nothing(rtctl, compiled):
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
def test_build_compiles_the_entry_points_of_a_run(rtctl, compiled, tmp_path, words, link, entries):
    code, out, err = rtctl("build", "ldu", *words)
    assert code == 0
    assert compiled == [("ldu", link)]
    assert "compiling" in err
    path, rest = out.strip().split(" ", 1)
    assert path.startswith(str(tmp_path))
    assert rest == f"compiled: {entries}"


def test_gain_change_keeps_the_tick_and_another_law_changes_it(rtctl, compiled):
    def path(*words):
        return rtctl("build", "ivu", *words).out.split()[0]

    assert path() == path("--set", "law.position.gain=20")
    assert path() != path("--mode", "fused")


def test_config_mistake_builds_nothing(rtctl, compiled):
    assert rtctl("build", "ivu", "--set", "law.position.gain=much").code == 2
    assert not compiled
