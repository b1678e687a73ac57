import json
import math
from types import SimpleNamespace

import pytest
import typer
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.cli import common
from rtctl.config.errors import UserError

NUMBERS = st.floats(1e-6, 1e6)


@settings(deadline=None)
@given(NUMBERS, st.sampled_from(list(common.SECONDS)), st.sampled_from(["", " "]))
def test_durations_are_parsed(number, unit, space):
    assert common.seconds(f"{number}{space}{unit}", "--for") == pytest.approx(number * common.SECONDS[unit])


@pytest.mark.parametrize("text", ["", "5x", "s", "-1s", "0", "1e999", "nan", "inf", "1.2.3", "1 2", "5 s 3"])
def test_invalid_duration_error_names_the_option(text):
    with pytest.raises(UserError, match="--for"):
        common.seconds(text, "--for")


@settings(deadline=None)
@given(st.text(max_size=8))
def test_random_text_is_a_value_or_a_user_error(text):
    for convert in (common.seconds, common.quantity_of):
        try:
            convert(text, "--for")
        except UserError as error:
            assert str(error).startswith("--for")


@settings(deadline=None)
@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(["mm/s", "rad", "%", None]))
def test_quantities_are_parsed(number, unit):
    assert common.quantity_of(f"{number}{unit or ''}", "x") == (number, unit)
    assert common.quantity_of(f" {number} {unit or ''}", "x") == (number, unit)


@settings(deadline=None)
@given(st.recursive(st.none() | st.integers() | st.floats(), lambda x: st.lists(x) | st.dictionaries(st.text(), x)))
def test_json_output_is_always_valid_json(value):
    def refuse(word):
        raise AssertionError(word)

    json.loads(json.dumps(common._finite(value)), parse_constant=refuse)


def test_json_keeps_numbers(capsys):
    common.print_json({"a": math.nan, "b": [1.5, -math.inf]})
    assert json.loads(capsys.readouterr().out) == {"a": None, "b": [1.5, None]}


app = typer.Typer(add_completion=False)


@app.command(cls=common.SignedCommand)
def _command(words: list[str], ramp: str = "", name: str = typer.Option("", "--name", "-n")) -> None:
    typer.echo(f"{words} {ramp} {name}")


@pytest.mark.parametrize(
    ("given", "heard"),
    [
        (["-1"], "['-1']  "),
        (["--", "-1"], "['-1']  "),
        (["-5nm", "--ramp", "2"], "['-5nm'] 2 "),
        (["x", "-.5", "rad", "--ramp", "2", "-n", "m"], "['x', '-.5', 'rad'] 2 m"),
        (["--ramp", "2", "-1e-3"], "['-1e-3'] 2 "),
        (["5", "--name", "m"], "['5']  m"),
    ],
)
def test_negative_numbers_are_arguments(given, heard, capsys):
    app(given, standalone_mode=False)
    assert capsys.readouterr().out.rstrip("\n") == heard


def test_word_with_a_dash_is_an_option():
    with pytest.raises(Exception, match="No such option"):
        app(["1", "--rmap", "2"], standalone_mode=False)


def test_mode_and_link_are_checked():
    config = SimpleNamespace()
    for mode, link in (("fast", None), (None, "tcp")):
        with pytest.raises(UserError, match="it is"):
            common.with_loop(config, mode, link)
    assert common.with_loop(config, None, None) is config


def test_default_folder_is_new(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    seen = set()
    for _ in range(3):
        folder = common.default_folder("ivu")
        folder.mkdir(parents=True)
        seen.add(folder)
    assert len(seen) == 3
