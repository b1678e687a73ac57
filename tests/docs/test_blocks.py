"""Code blocks of the manual: commands parse, configs are valid, Python compiles, the quick start runs."""

import re
import shlex

import pytest
import yaml
from manual_blocks import PAGES, ROOT, Block, blocks, commands

from rtctl.campaign.plan import load_plan
from rtctl.cli.common import load_config
from rtctl.config.errors import UserError
from rtctl.config.load import set_paths
from rtctl.machines import CONFIGS
from rtctl.manual.commands import parse
from rtctl.manual.pages import generated

FILE = re.compile(r"^\.?/?(?:configs|docs|systemd|benchmarks|tests|drivers|plants)/[\w./@-]+$")
MADE_THERE = re.compile(r"^docs/man/|^build/")
SHOWN = [block for page in PAGES for block in blocks(page)]
MADE = [block for name, text in generated().items() for block in blocks(ROOT / "docs" / name, text)]


def test_manual_has_code_blocks():
    assert len([line for block in SHOWN for line in commands(block)]) > 60


@pytest.mark.parametrize("block", [b for b in SHOWN if b.language in ("bash", "console")], ids=lambda b: b.where)
def test_commands_in_the_manual_parse(block):
    wrong = []
    for where, line in commands(block):
        try:
            parse(line)
        except UserError as error:
            wrong.append(f"{where}: {error}")
    for word in shlex.split(block.text, comments=True) if block.language == "bash" else ():
        if FILE.match(word) and not MADE_THERE.match(word) and not (ROOT / word).exists():
            wrong.append(f"{block.where}: {word}: no such file")
    assert wrong == []


def test_commands_in_generated_pages_parse():
    for block in MADE:
        for _, line in commands(block):
            parse(line)


def test_make_targets_in_the_manual_exist():
    named = {word for b in SHOWN if b.language == "bash" for word in re.findall(r"^make (\w+)", b.text, re.M)}
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.M))
    assert named and named <= targets


@pytest.mark.parametrize("block", [b for b in (*SHOWN, *MADE) if b.language == "yaml"], ids=lambda b: b.where)
def test_yaml_blocks_are_valid_configs(block, tmp_path):
    data = yaml.safe_load(block.text)
    file = tmp_path / "config.yaml"
    file.write_text(block.text)
    if "campaign" in data:
        assert load_plan(str(file), load_config).runs > 0
    elif "machine" in data:
        load_config(str(file), None)
    elif "steps" in data:
        of_a_reel = "mm" not in block.text  # positions in rad, else in m
        load_config("ivu" if of_a_reel else "ldu", [f"reference={block.text}"])
    elif data.keys() <= CONFIGS["ivu"].model_fields.keys() and "columns" not in data:  # a part of one
        set_paths(load_config("ivu", None), data)


@pytest.mark.parametrize("block", [b for b in SHOWN if b.language == "python"], ids=lambda b: b.where)
def test_python_blocks_compile(block):
    if "..." not in block.text and not block.text.startswith("class "):
        compile(block.text, block.where, "exec")


def test_invalid_command_is_found():
    def complaint(line: str) -> str:
        with pytest.raises(UserError) as caught:
            parse(line)
        return str(caught.value)

    assert "--fro" in complaint("rtctl run ivu --fro 12s")
    assert "no command 'rnu'" in complaint("rtctl rnu ivu")
    assert "no experiment 'frff'" in complaint("rtctl identify frff ivu")
    assert "is a group" in complaint("rtctl campaign")
    assert "missing" in complaint("rtctl run").lower()
    assert parse("rtctl schema ivu > ivu.schema.json") == ("rtctl", "schema")
    text = "```console\n$ rtctl run ivu \\\n    --fro 1s\n  answer\n```\n"
    assert list(commands(blocks(PAGES[0], text)[0])) == [(f"{PAGES[0]}:2", "rtctl run ivu  --fro 1s")]


def first_commands(page: str) -> list[str]:
    """Commands of a page that run on virtual time and write files."""
    return [line for b in blocks(ROOT / "docs" / page) for _, line in commands(b) if "--mode fused" in line]


def test_quick_start_runs(rtctl_here, tmp_path):
    """First commands of the quick start, verbatim."""
    for line in (
        "rtctl check ivu",
        *first_commands("quickstart.md"),
        "rtctl trace info runs/first",
        "rtctl trace compare runs/first runs/soft",
        "rtctl replay runs/first",
    ):
        code, out, err = rtctl_here(*shlex.split(line)[1:])
        assert code == 0, (line, out, err)
    assert {p.name for p in (tmp_path / "runs").iterdir()} == {"first", "soft"}
    quick = (ROOT / "docs" / "quickstart.md").read_text()
    assert all(f"\n{line}" in quick for line in ("rtctl check ivu", "rtctl replay runs/first"))


@pytest.fixture
def rtctl_here(tmp_path, monkeypatch, capsys):
    """`rtctl_here("check", "ivu")` in an empty folder: exit code and output."""
    from rtctl.cli.main import main

    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> tuple[int, str, str]:
        code = main(list(arguments))
        return (code, *capsys.readouterr())

    return call


def test_api_example_runs(capsys):
    block = blocks(ROOT / "docs" / "api.md")[0]
    names: dict = {}
    exec(compile(block.text, block.where, "exec"), names)
    assert set(names["settling"]) == {15.0, 31.0, 45.0}
    assert capsys.readouterr().out.count("settles in") == 3


def test_unclosed_fence_is_not_a_block():
    assert blocks(PAGES[0], "```bash\nrtctl run\n") == []
    assert blocks(PAGES[0], "```bash\nrtctl run\n```\n") == [Block(PAGES[0], 2, "bash", "rtctl run\n")]
