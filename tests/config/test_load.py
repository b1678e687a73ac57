import contextlib
from pathlib import Path
from typing import Annotated, Literal

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field, model_validator

from rtctl.config.errors import UserError
from rtctl.config.load import get_path, load_settings, set_path, to_yaml
from rtctl.idiom import Settings, quantity
from rtctl.machines import CONFIGS

CONFIG_FOLDER = Path(__file__).parents[2] / "configs"
REFERENCES = {"ivu": ["steps", "constant_speed"], "ldu": ["print_steps"], "axis": ["print_steps"]}


class Pd(Settings):
    kind: Literal["pd"] = "pd"
    gain: float = quantity(unit="V/rad", gt=0, help="gain")


class Notch(Settings):
    kind: Literal["notch"] = "notch"
    frequency: float = quantity(unit="Hz", gt=0, help="centre")


class Limit(Settings):
    high: float = quantity(10.0, unit="V", gt=0, le=24, help="highest")
    slew: float | None = quantity(None, unit="V/s", gt=0, help="fastest")


class Small(Settings):
    rate: float = quantity(unit="Hz", gt=0, help="ticks a second")
    mode: Literal["real", "fused"] = "real"
    law: Annotated[Pd | Notch, Field(discriminator="kind")] = Pd(gain=1.0)
    sections: list[Annotated[Pd | Notch, Field(discriminator="kind")]] = Field(default=[])
    limit: Limit = Limit(high=3.0)
    count: int = 1
    on: bool = False
    name: str = "x"
    pairs: list[tuple[float, float]] = Field(default=[])
    span: tuple[float, float] = (0.0, 1.0)

    @model_validator(mode="after")
    def _fits(self) -> "Small":
        if self.count > 100:
            raise ValueError("count is more than the rate can carry")
        for i, (at, _) in enumerate(self.pairs):
            if at > 9:
                raise ValueError(f"pairs.{i}.0: later than 9 s")
        return self


@pytest.fixture
def load(tmp_path):
    def load(text, *overrides):
        path = tmp_path / "s.yaml"
        path.write_text(text)
        return load_settings(path, Small, overrides)

    return load


def complaint(load, text, *overrides):
    with pytest.raises(UserError) as error:
        load(text, *overrides)
    return str(error.value)


@pytest.mark.parametrize("kind", CONFIGS)
def test_machine_configs_survive_a_round_trip(kind, tmp_path):
    config = load_settings(CONFIG_FOLDER / f"{kind}.yaml", CONFIGS[kind])
    for full in (False, True):
        path = tmp_path / "again.yaml"
        path.write_text(to_yaml(config, full))
        assert load_settings(path, CONFIGS[kind]) == config


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind, names in REFERENCES.items() for name in names])
def test_shipped_references_load(kind, name):
    model = CONFIGS[kind].model_fields["reference"].annotation
    assert load_settings(CONFIG_FOLDER / "references" / f"{name}.yaml", model).steps


def test_every_config_mistake_is_one_line(tmp_path):
    text = (CONFIG_FOLDER / "ivu.yaml").read_text()
    path = tmp_path / "ivu.yaml"
    path.write_text(text.replace("rate: 500 Hz", "rate: 500 mm").replace("gain: 31", "gian: 31"))
    with pytest.raises(UserError) as error:
        load_settings(path, CONFIGS["ivu"])
    lines = str(error.value).splitlines()
    number = 1 + text[: text.index("gain: 31")].count("\n")
    assert lines[0] == f"{path}:6: loop.rate: '500 mm' is not a quantity in Hz"
    assert f"{path}:{number}: law.position.gian: unknown key; did you mean 'gain'?" in lines
    assert any("law.position: missing key 'gain'" in line for line in lines)
    assert len(lines) == 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mode: fused", "s.yaml: missing key 'rate' (ticks a second, in Hz)"),
        ("", "missing key 'rate'"),
        ("- 1", "s.yaml: expected keys such as rate, mode, law, sections, not a list of 1"),
        ("rate: 5\nmdoe: real", "s.yaml:2: mdoe: unknown key; did you mean 'mode'?"),
        ("rate: 5\nmode: reel", "s.yaml:2: mode: 'reel' is not one of real, fused; did you mean 'real'?"),
        ("rate: [1]", "rate: expected a number with a unit such as '1.5 Hz', or just a number in Hz, not a list of 1"),
        ("rate: true", "rate: true is not a number"),
        ("rate: .inf", "rate: .inf is not finite"),
        ("rate: -5", "rate: -5 Hz is out of bounds: it must be more than 0 Hz"),
        ("rate: 5\nlimit: {high: 30000 mV}", "limit.high: '30000 mV' is out of bounds: it must be at most 24 V"),
        ("rate: 5\nlaw: {kind: notsh}", "s.yaml:2: law.kind: 'notsh' is not one of pd, notch; did you mean 'notch'?"),
        ("rate: 5\nlaw: {gain: 1}", "law: missing key 'kind': pd, notch"),
        ("rate: 5\nlaw: 3", "law: expected keys such as kind, not 3"),
        ("rate: 5\ncount: 1.5", "count: expected a whole number, not 1.5"),
        ("rate: 5\non: 7", "on: expected true or false, not 7"),
        ("rate: 5\nname: 7", "name: expected text, not 7; put it in quotes"),
        ("rate: 5\nsections: pd", "sections: expected a list, not 'pd'"),
        ("rate: 5\npairs:\n- [1]", "s.yaml:3: pairs.0: item 1 is missing"),
        ("rate: 5\ncount: 500", "s.yaml: count is more than the rate can carry"),
    ],
)
def test_config_error_message(load, text, message):
    assert message in complaint(load, text)


def test_error_in_a_choice_concerns_the_chosen_kind_only(load):
    text = complaint(load, "rate: 5\nsections:\n- {kind: notch, frequency: 3 m}\n- {kind: pd, frequency: 3}")
    assert "s.yaml:3: sections.0.frequency: '3 m' is not a quantity in Hz" in text
    assert "s.yaml:4: sections.1.frequency: unknown key" in text
    assert "s.yaml:4: sections.1: missing key 'gain'" in text
    assert len(text.splitlines()) == 3


def test_at_most_twenty_mistakes_are_reported(load):
    lines = complaint(load, "rate: 5\n" + "".join(f"k{i}: 1\n" for i in range(30))).splitlines()
    assert len(lines) == 21
    assert lines[-1] == "and 10 more"


def test_overrides_reach_keys_lists_and_defaults(load):
    got = load("rate: 5", "rate=1 kHz", "limit.slew=5 V/s", "sections.0={kind: pd, gain: 2}", "sections.0.gain=3 V/rad")
    assert (got.rate, got.limit.slew, got.sections[0].gain) == (1000.0, 5.0, 3.0)
    assert got.limit.high == 3.0  # default of the group
    assert load("rate: 5", "law.gain=4").law == Pd(gain=4.0)


def test_partial_group_keeps_the_other_defaults(load):
    assert load("rate: 5\nlimit: {slew: 2}").limit == Limit(high=3.0, slew=2.0)
    assert load("rate: 5\nlaw: {kind: notch, frequency: 9}").law == Notch(frequency=9.0)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("rate", "--set rate: write key=value"),
        ("=5", "--set =5: a key is missing"),
        ("rate.x=5", "--set rate.x=5: rate is a value and has no key 'x'"),
        ("sections.1={}", "--set sections.1={}: '1' is not an index of sections, which has 0 items"),
        ("rate=[1", "--set rate=[1"),
        ("raet=7", "--set raet=7: unknown key; did you mean 'rate'?"),
        ("limt.high=7", "--set limt.high=7: limt: unknown key; did you mean 'limit'?"),
        ("limit.high=3 m", "--set limit.high=3 m: '3 m' is not a quantity in V"),
        (".".join("a" * 90) + "=1", "no key is that deep"),
    ],
)
def test_invalid_override_is_named(load, override, message):
    assert message in complaint(load, "rate: 5", override)


def test_yaml_keeps_text_that_resembles_other_types(load, tmp_path):
    for word in ("off", "1e3", "true", "null", "", "12:30", "0x1F", "~", "a: b"):
        config = Small(rate=5.0, name=word)
        assert load(to_yaml(config)) == config
        assert yaml.safe_load(to_yaml(config))["name"] == word  # also under YAML 1.1


def test_get_and_set_of_a_setting():
    config = load_settings("ldu", CONFIGS["ldu"])
    before = get_path(config, "law.position.gain")
    changed = set_path(config, "law.position.gain", "3 V/mm")
    assert get_path(changed, "law.position.gain") == 3000.0
    assert get_path(config, "law.position.gain") == before
    assert set_path(changed, "law.position.gain", before) == config
    assert changed.model_fields_set == config.model_fields_set | {"machine"}
    assert changed.law.model_fields_set == config.law.model_fields_set


def test_set_extends_the_default_of_an_unwritten_group():
    config = load_settings("ldu", CONFIGS["ldu"])
    assert get_path(set_path(config, "amplifier.kind", "measured"), "amplifier.kind") == "measured"
    assert set_path(Small(rate=1.0), "limit.slew", "5 V/s").limit == Limit(high=3.0, slew=5.0)
    assert set_path(Small(rate=1.0), "law.gain", 2).law == Pd(gain=2.0)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("law.gian", 3, "law.gian: unknown key; did you mean 'gain'?"),
        ("law.gain", "3 mm", "law.gain: '3 mm' is not a quantity in V/rad"),
        ("law.gain", -1, "law.gain: -1 V/rad is out of bounds"),
        ("law.gain.x", 1, "law.gain is a value"),
        ("sections.-1", {}, "'-1' is not an index"),
        ("", 1, "a key is missing"),
        ("law.kind", "notch", "law: missing key 'frequency'"),
    ],
)
def test_set_refuses_invalid_values(path, value, message):
    with pytest.raises(UserError) as error:
        set_path(Small(rate=5.0, law=Pd(gain=1.0)), path, value)
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("law.gian", "did you mean 'gain'"),
        ("rate.x", "is a value"),
        ("sections.0", "not an index"),
        ("__class__", "unknown key"),
    ],
)
def test_get_refuses_unknown_paths(path, message):
    with pytest.raises(UserError, match=message):
        get_path(Small(rate=5.0), path)


VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(["pd", "5 Hz", "off"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["kind", "gain", "high", "x"]), inner),
    max_leaves=6,
)
KEYS = [*Small.model_fields, "nope", "0"]


@settings(deadline=None)
@given(st.dictionaries(st.sampled_from(KEYS), VALUES, max_size=5))
def test_any_structure_is_settings_or_a_user_error(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "structure.yaml"
    path.write_text(yaml.safe_dump(data, allow_unicode=False))
    try:
        load_settings(path, Small)
    except UserError as error:
        assert all("structure.yaml" in line for line in str(error).splitlines())


@settings(deadline=None)
@given(st.text(alphabet="abclawgain.=0123 {}[]:,-*&!'\"", max_size=40), VALUES)
def test_any_override_path_or_value_is_settings_or_a_user_error(text, value):
    config = Small(rate=5.0)
    key = text.partition("=")[0]
    for attempt in (
        lambda: load_settings("ivu", CONFIGS["ivu"], [text]),
        lambda: set_path(config, key, value),
        lambda: set_path(config, "law", value),
        lambda: set_path(config, "pairs", value),
        lambda: get_path(config, text),
    ):
        with contextlib.suppress(UserError):
            attempt()


@pytest.mark.parametrize("text", ["-1e6", "0x00", "-1.50"])
def test_error_shows_a_number_out_of_bounds_as_written(load, text):
    assert f"rate: {text} Hz is out of bounds" in complaint(load, f"rate: {text}\n")


def test_error_shows_an_override_as_written(load):
    assert "--set rate=-1e3: -1e3 Hz is out of bounds" in complaint(load, "rate: -2.50\n", "rate=-1e3")


def test_error_shows_a_too_large_number_as_written(load):
    assert "rate: 9999" in complaint(load, "rate: " + "9" * 390 + "\n")


def test_group_validator_can_name_a_key_of_the_group(load):
    text = "rate: 5\npairs:\n  - [1, 2]\n  - [10, 2]\n"
    assert complaint(load, text).endswith("s.yaml:4: pairs.1.0: later than 9 s")
    assert "--set pairs.0.0=11: later than 9 s" in complaint(load, text.replace("10,", "3,"), "pairs.0.0=11")


def test_item_of_an_unwritten_pair_can_be_set(load):
    assert set_path(load("rate: 5\n"), "span.1", 4.0).span == (0.0, 4.0)
