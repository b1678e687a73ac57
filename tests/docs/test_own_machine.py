"""Manual page on user machines: its commands run in one folder, in order."""

import os
import shlex

from manual_blocks import ROOT, blocks, commands

from rtctl.cli.main import main

PAGE = ROOT / "docs" / "bring_your_own_machine.md"


def test_commands_of_the_page_on_user_machines_run(runtime, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    said: dict[str, str] = {}
    for line in (line for block in blocks(PAGE) for _, line in commands(block)):
        words = shlex.split(line)[1:]
        own = ["--set", f"name=own{os.getpid()}"] if words[0] == "run" else []
        assert main([*words, *own]) == 0, (line, capsys.readouterr())
        said[words[0]] = capsys.readouterr().out
    assert (tmp_path / "my_belt.svg").read_text().startswith("<svg")
    shown = next(block.text for block in blocks(PAGE) if block.language == "text")
    told = " ".join(said["check"].split())
    for part in shown.split("\n"):
        assert " ".join(part.split()) in told, part
    assert "identical to the bit" in said["replay"]
