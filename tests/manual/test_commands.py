import re

import pytest

from rtctl.cli.main import COMMANDS
from rtctl.manual.command_pages import cell, command_pages, prose
from rtctl.manual.commands import commands, parse

ALL = list(commands())


def is_ours(line: str) -> bool:
    return line.split()[0] == "rtctl"


def test_every_command_is_in_the_manual():
    assert {c.words[1] for c in ALL if len(c.words) > 1} == set(COMMANDS)


@pytest.mark.parametrize("command", ALL, ids=lambda c: c.name)
def test_every_command_is_described(command):
    assert command.text and all(command.text)
    assert [p.names for p in command.parameters if not p.help] == []
    assert [p.names for p in command.parameters if p.value == "VALUE"] == []  # names its value
    if not command.group:
        assert command.examples
    called = [parse(part) for example in command.examples for part in re.split(r" && | \| ", example) if is_ours(part)]
    assert command.group or command.words in called


def test_page_of_commands():
    text = command_pages()["commands.md"]
    assert "## rtctl run { #rtctl-run }" in text and "### rtctl campaign run { #rtctl-campaign-run }" in text
    assert "rtctl run [OPTIONS] CONFIG" in text
    assert "rtctl run ivu --for 12s --reference steps" in text
    for command in ALL:
        for parameter in command.parameters:
            assert [name for name in parameter.names if f"`{name}`" not in text] == []


def test_markdown_characters_are_escaped():
    assert prose("a < b, `c < d`") == "a &lt; b, `c < d`"
    assert cell("a | b\n c") == "a \\| b c"
