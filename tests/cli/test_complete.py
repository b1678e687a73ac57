"""Shell completion: offered words, and no heavy imports."""

import json
import os
import subprocess
import sys

import pytest

from rtctl.cli import complete
from rtctl.config.schema import settings_table
from rtctl.machines import CONFIGS


def offered(shell: str, line: str, **environment: str) -> list[str]:
    """Words that the completion script of a shell gets for a command line."""
    words = {"COMP_WORDS": line, "COMP_CWORD": str(len(line.split(" ")) - 1)} if shell == "bash" else {}
    done = subprocess.run(
        [sys.executable, "-c", "import sys; from rtctl.cli.main import main; sys.exit(main([]))"],
        env={**os.environ, "_RTCTL_COMPLETE": f"complete_{shell}", "_TYPER_COMPLETE_ARGS": line,
             "_TYPER_COMPLETE_FISH_ACTION": "get-args", **words, **environment},
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.stderr == ""
    return done.stdout.split()


@pytest.mark.parametrize("shell", ["bash", "fish"])
def test_completion_offers_commands_and_options(shell):
    assert [word for word in offered(shell, "rtctl dia") if word.startswith("dia")] == ["diagnose"]
    assert "frf" in offered(shell, "rtctl identify f")


def test_zsh_completion_includes_the_help_texts():
    assert "ldu_printer" in " ".join(offered("zsh", "rtctl run ldu_"))


def test_completion_offers_configs_references_and_campaigns(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "bench.yaml").write_text("")
    (tmp_path / "more.yaml").write_text("")
    (tmp_path / "notes.txt").write_text("")
    assert complete.configs("") == [
        "axis", "ivu", "ivu_coarse", "ivu_precise", "ldu", "ldu_printer", "mine/", "more.yaml",
    ]  # fmt: skip
    assert complete.configs("mine/") == ["mine/bench.yaml"]
    assert complete.configs(f"{tmp_path}/m") == [f"{tmp_path}/mine/", f"{tmp_path}/more.yaml"]
    assert complete.configs("nowhere/") == []
    assert complete.references("st") == ["steps"]
    assert "radii_10000" in complete.campaigns("")


def test_completion_reads_setting_keys_from_the_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("RTCTL_CACHE_DIR", str(tmp_path))
    fresh = complete.keys("law.position.")
    assert {"law.position.gain", "law.position.kind"} <= set(fresh)
    (file,) = tmp_path.iterdir()
    file.write_text(json.dumps({"keys": ["law.position.other"], "faults": [], "terms": []}))
    assert complete.keys("law.position.") == ["law.position.other"]
    os.utime(file, (0, 0))  # older than the sources
    assert complete.keys("law.position.") == fresh
    file.write_text("{")
    assert complete.keys("law.position.") == fresh


def test_completed_keys_are_the_settings_of_all_machines():
    found = set(complete.words()["keys"])
    assert all("[" not in word for word in found)
    for model in CONFIGS.values():
        assert {r.path for r in settings_table(model) if "[" not in r.path and r.type != "keys"} <= found
    assert "encoder.freeze" in complete.faults("enc") and complete.terms("ripple.e") == ["ripple.encoder"]


def test_completion_offers_running_machines(monkeypatch):
    monkeypatch.setattr("rtctl.cli.common.running", lambda: ["ivu", "ldu"])
    assert complete.machines("l") == ["ldu"]


def test_completion_imports_nothing_heavy(tmp_path):
    complete.words()
    code = """
import sys
from rtctl.cli import complete
complete.configs(''), complete.references(''), complete.campaigns(''), complete.keys('law')
print([m for m in ('numpy', 'numba', 'pydantic', 'zmq', 'pint') if m in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path)
    assert (done.stdout, done.stderr) == ("[]\n", "")
