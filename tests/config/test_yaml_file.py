import contextlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config import yaml_file
from rtctl.config.errors import UserError
from rtctl.config.yaml_file import find, load_yaml, parse, told


def test_yaml_scalars_follow_yaml_1_2():
    data = parse("a: off\nb: yes\nc: true\nd: 1e3\ne: 4.0e-3\nf: 12:30\ng: 010\nh: '5'\ni:\nj: 2001-01-01", "x").data
    assert data == {
        "a": "off", "b": "yes", "c": True, "d": 1000.0, "e": 4e-3, "f": "12:30", "g": 10, "h": "5", "i": None,
        "j": "2001-01-01",
    }  # fmt: skip
    assert isinstance(data["d"], float)


def test_line_of_every_key_and_item_is_known():
    document = parse("# title\na:\n  b: 1\n  c:\n    - 5\n    - {d: 6}\n", "x")
    assert [document.line(path) for path in (("a",), ("a", "b"), ("a", "c", 0), ("a", "c", 1, "d"))] == [2, 3, 5, 6]
    assert document.line(("a", "b", "z")) == 3
    assert document.line(("z",)) is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: 2\na: 3", "f.yaml:3: not YAML: the key 'a' is here twice, first in line 1"),
        ("a: [1, 2", "f.yaml:1: not YAML: while parsing a flow sequence"),
        ("a: 1\n\tb: 2", "f.yaml:2: not YAML"),
        ("a: !!python/object:os.system x", "f.yaml:1: not YAML: 'x' cannot be a"),
        ("a: !thing {}", "f.yaml:1: not YAML: tags such as !thing"),
        ("? [a, b]\n: 1", "f.yaml:1: not YAML: a key must be a word"),
        ("a: 1\nb: \x01", "f.yaml:2: not YAML: the character"),
        ("a: 1\n---\nb: 2", "f.yaml:2: not YAML: expected a single document"),
        ("[" * 200, "f.yaml:1: not YAML: nested more than 60 deep"),
        ("a: &a [*a]", "f.yaml:1: not YAML: nested more than 60 deep"),
        ("a: *b", "f.yaml:1: not YAML: found undefined alias"),
    ],
)
def test_yaml_error_names_the_line(text, message):
    with pytest.raises(UserError) as error:
        parse(text, "f.yaml")
    assert message in str(error.value)


def test_alias_bomb_is_not_expanded():
    rows = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    rows += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 9)]
    with pytest.raises(UserError, match="more than 20000 values, aliases unfolded"):
        parse("\n".join(rows), "f.yaml")


def test_alias_has_the_value_of_its_anchor():
    assert parse("a: &x {b: 1}\nc: *x", "f").data == {"a": {"b": 1}, "c": {"b": 1}}


def test_unreadable_file_is_an_error(tmp_path):
    binary, big = tmp_path / "binary.yaml", tmp_path / "big.yaml"
    binary.write_bytes(b"a: 1\nb: \xff\xfe")
    big.write_bytes(b"#" * (yaml_file.MOST_BYTES + 1))
    for path, message in (
        (tmp_path, "is a folder"),
        (tmp_path / "none.yaml", "no such file"),
        (binary, "binary.yaml:2: not UTF-8"),
        (big, "bigger than 1 MiB"),
        ("a\0b", "not the name of a file"),
        ("/dev/zero", "not a regular file"),
    ):
        with pytest.raises(UserError, match=message):
            load_yaml(path)


def test_config_is_found_by_path_by_stem_and_among_the_shipped(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text("a: 1")
    (tmp_path / "ivu").mkdir()
    assert find("mine").name == find(tmp_path / "mine.yaml").name == "mine.yaml"
    assert find("ivu").name == "ivu.yaml"
    assert find("ldu.yaml").is_file()
    assert find("references/steps") == find("steps") == find("steps.yaml")


@pytest.mark.parametrize(
    "path", ["./ivu.yaml", "./ivu", "sub/ivu.yaml", "../ivu.yaml", "{here}/ivu.yaml", "~/ivu.yaml"]
)
def test_path_with_a_folder_never_finds_a_shipped_config(tmp_path, monkeypatch, path):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=r"no such file; the one that comes with rtctl is called by its bare name, ivu"):
        find(path.format(here=tmp_path))


def test_message_names_the_file_of_a_config_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert told("ivu.yaml").endswith("configs/ivu.yaml, which comes with rtctl")
    (tmp_path / "ivu.yaml").write_text("machine: ivu")
    assert told("ivu.yaml") == told("./ivu.yaml") == f"config {tmp_path / 'ivu.yaml'}"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("ivuu", "did you mean 'ivu'"),
        ("stepps", "'references/steps'"),
        ("qqqqqqq", "rtctl comes with"),
        ("", "no such"),
    ],
)
def test_unknown_config_error_suggests_the_nearest_name(name, message):
    with pytest.raises(UserError, match=message):
        find(name)


@settings(deadline=None)
@given(st.one_of(st.text(max_size=200), st.text(alphabet="[]{}:,-&*!|>'\"\\?% \n\tab01.~#<", max_size=80)))
def test_any_text_is_data_or_a_user_error(text):
    try:
        parse(text, "f.yaml")
    except UserError as error:
        assert str(error).startswith("f.yaml")


@settings(deadline=None, max_examples=50)
@given(content=st.binary(max_size=200))
def test_any_bytes_are_data_or_a_user_error(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "fuzz.yaml"
    path.write_bytes(content)
    with contextlib.suppress(UserError):
        load_yaml(path)


@settings(deadline=None, max_examples=50)
@given(st.text(max_size=300))
def test_any_name_is_found_or_a_user_error(name):
    with contextlib.suppress(UserError):
        find(name)
