import ast
import re
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest

from rtctl import machines, sources
from rtctl.config.errors import UserError
from rtctl.loop import generate


@pytest.fixture
def path(config: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Path of the module generated from a config, in an empty cache; nothing is compiled."""
    monkeypatch.setenv("RTCTL_CACHE_DIR", str(tmp_path / "cache"))

    def make(kind: str = "ivu", link: str = "shm", **set_: Any) -> Path:
        return generate.write(machines.build(config(kind, set=set_)), link)

    return make


def test_same_config_generates_the_same_module(path: Callable[..., Path]) -> None:
    first = path()
    written = first.stat().st_mtime_ns
    assert path() == first and first.stat().st_mtime_ns == written


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("law.position.gain", 20.0),
        ("radius.source", "measured"),
        ("board.dither", True),
        ("safety.ramp", 0.1),
        ("law.limit", {"high": 5.0}),
        ("plant.parameters", {"R1": 0.03}),
        ("excitation", {"kind": "noise", "rms": 0.1, "f_max": 50.0}),
        ("reference", {"steps": [{"at": 1.0, "to": 1.0}]}),
        ("record.seconds", 5.0),
    ],
)
def test_parameters_do_not_recompile(path: Callable[..., Path], key: str, value: Any) -> None:
    assert path(**{key: value}) == path()


@pytest.mark.parametrize(
    ("kind", "key", "value"),
    [
        ("ivu", "plant.physics", [{"term": "friction.viscous", "node": "motor1", "B": 1e-4}]),
        ("ivu", "plant.follow_tape", False),
        ("ivu", "record.truth", False),
        ("ldu", "law.position", {"kind": "pd", "gain": 1.0}),
    ],
)
def test_structural_change_generates_another_module(path: Callable[..., Path], kind: str, key: str, value: Any) -> None:
    assert path(kind, **{key: value}) != path(kind)


def test_each_machine_and_link_has_a_separate_module(path: Callable[..., Path]) -> None:
    made = {path(kind, link) for kind in machines.MODULES for link in ("zmq", "shm")}
    assert len(made) == 2 * len(machines.MODULES)


@pytest.mark.parametrize("kind", machines.MODULES)
def test_generated_source_follows_the_stages_of_the_diagram(config: Callable[..., Any], kind: str) -> None:
    machine = machines.build(config(kind))
    text = generate.source(machine, "shm")
    ast.parse(text)
    tick = text[text.index("def tick(") : text.index("def start(")]
    stages = re.findall(r"^    # (.*)$", tick, re.MULTILINE)
    assert stages == [*(name for name, _ in machine.diagram.stages), "truth"]
    assert stages.index("law") < stages.index("safety") < stages.index("write")
    assert text.count("\n\n\n\n") == 0 and "\t" not in text
    for name in ("start", "advance", "sample", "run_real", "run_lockstep", "run_fused", "plant_real", "plant_lockstep"):
        assert text.count(f"def {name}(") == 1, name


def test_traced_state_field_becomes_a_column(config: Callable[..., Any], bench: Callable[..., Any]) -> None:
    machine = machines.build(config(set={"record.trace": ["position.d", "safety.silent"]}))
    text = generate.source(machine, "shm")
    assert "y.position_d = s.position.d" in text
    made = generate.generate(machine, "shm")
    assert [c.name for c in made.columns][-2:] == ["position_d", "safety_silent"]
    assert made.row.names == tuple(c.name for c in made.columns)


def test_row_has_every_column_and_an_integer_tick(config: Callable[..., Any]) -> None:
    made = generate.generate(machines.build(config()), "shm")
    assert made.row.names == tuple(c.name for c in made.columns) and len(set(made.row.names)) == len(made.columns)
    assert made.row["tick"] == np.int64
    assert all(c.help for c in made.columns)


@pytest.fixture
def fresh_hash() -> Any:
    sources.sources_hash.cache_clear()
    yield sources.sources_hash
    sources.sources_hash.cache_clear()


def test_changed_source_or_version_changes_the_hash(fresh_hash: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    before = fresh_hash()
    fresh_hash.cache_clear()
    assert fresh_hash() == before and re.fullmatch("[0-9a-f]{64}", before)
    read = Path.read_bytes
    for changed in ("pd.py", "l292.py", "friction.py", "runner.py"):  # a law, a driver, the physics, the loop
        fresh_hash.cache_clear()
        with monkeypatch.context() as patch:
            patch.setattr(Path, "read_bytes", lambda p, changed=changed: read(p) + b"#" * (p.name == changed))
            assert fresh_hash() != before, changed
    fresh_hash.cache_clear()
    monkeypatch.setattr(sources.numba, "__version__", "0.0")
    assert fresh_hash() != before


def test_source_outside_the_tick_does_not_change_the_hash(fresh_hash: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    before = fresh_hash()
    read = Path.read_bytes
    fresh_hash.cache_clear()
    monkeypatch.setattr(Path, "read_bytes", lambda p: read(p) + b"#" * (p.name == "session.py"))
    assert fresh_hash() == before


def test_unwritable_cache_is_reported(
    config: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("RTCTL_CACHE_DIR", str(tmp_path / "file" / "cache"))
    with pytest.raises(UserError, match=r"cannot write the generated tick .*; set RTCTL_CACHE_DIR"):
        generate.write(machines.build(config()), "shm")


@pytest.mark.parametrize("elsewhere", [False, True])
def test_compiled_code_is_found_in_the_cache_folder_of_numba(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, elsewhere: bool
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", folder := str(tmp_path / "numba") if elsewhere else "")
    monkeypatch.setattr("numba.core.config.CACHE_DIR", folder)  # numba reads the environment once
    text = "import numba\n\n\n@numba.njit(cache=True)\ndef entry(x):\n    return x\n"
    path = tmp_path / f"small_{elsewhere}.py"
    path.write_text(text)
    module = generate.load(path)
    assert not generate.is_warm(path, "entry")
    module.entry(1)
    assert generate.is_warm(path, "entry")
    assert not generate.is_warm(path, "other")
    assert (tmp_path / "numba").exists() == elsewhere


def test_one_process_at_a_time_compiles_an_entry_point(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    path = tmp_path / "small.py"
    order: list[str] = []

    def other() -> None:
        with generate.turn(path, "entry"):
            order.append("other")

    with generate.turn(path, "entry"), generate.turn(path, "another"):
        with (tmp_path / "small.entry.lock").open("w") as file:
            assert not generate._locked(file)
        thread = Thread(target=other)
        thread.start()
        order.append("first")
    thread.join()
    assert order == ["first", "other"]
    with generate.turn(path, "entry"):
        monkeypatch.setattr(generate, "PATIENCE", 0.0)  # s, waiting time for a stopped process
        other()
    monkeypatch.setattr(generate, "is_warm", lambda *_: True)
    with generate.turn(path, "third"):
        assert not (tmp_path / "small.third.lock").exists()
