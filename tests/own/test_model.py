"""User files in a config: allowed parts, generated tick, and error messages."""

import ast
from pathlib import Path
from types import SimpleNamespace

import pytest
from rtctl_config import TEMPLATES, loaded

from rtctl import machines
from rtctl.config.errors import UserError
from rtctl.config.fields import written
from rtctl.config.load import get_path, set_path, to_yaml
from rtctl.config.schema import json_schema
from rtctl.daemon.reload import reload
from rtctl.loop import generate
from rtctl.machines.own_check import verdicts
from rtctl.own.files import OwnError

TRY = {"kind": "./try.py:Try", "gain": "31 V/rad"}
TERM = "./my_term.py:MyTerm"


@pytest.fixture
def own(config_file, law):
    return loaded(config_file("ivu", {"try.py": law()}, position=TRY))


def text_of(config):
    return generate.source(machines.build(config), "shm")


def test_config_without_user_files_has_the_class_of_the_machine(config):
    made = config("ldu")
    assert type(made) is machines.CONFIGS["ldu"]
    assert made.own == {}
    assert machines.widened(written(made)) == (type(made), written(made))


def test_keys_units_and_bounds_come_from_the_user_file(own):
    assert own.law.position.gain == 31.0
    assert get_path(own, "law.position.kind") == "./try.py:Try"
    assert set_path(own, "law.position.gain", "20 V/rad").law.position.gain == 20.0
    with pytest.raises(UserError, match="out of bounds: it must be at most 100 V/rad"):
        set_path(own, "law.position.gain", 1e3)
    with pytest.raises(UserError, match="unknown key; did you mean 'gain'"):
        set_path(own, "law.position.gian", 1)
    assert json_schema(type(own))["$defs"]["TrySettings"]["properties"]["gain"]["unit"] == "V/rad"


def test_plain_data_contains_the_texts_of_user_files(own, config_file):
    (Path(config_file("ivu", {})).parent / "try.py").unlink()
    again = machines.settings(written(own))
    assert type(again) is type(own) and again == own
    assert machines.settings(own.model_dump(mode="json", exclude_unset=True)) == own


def test_written_config_needs_no_user_file(own, tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "written.yaml").write_text(to_yaml(own))
    assert loaded(tmp_path / "there" / "written.yaml") == own


def test_changed_text_changes_the_tick_and_a_changed_gain_does_not(own, config_file, law):
    text = text_of(own)
    ast.parse(text)
    assert text == text_of(set_path(own, "law.position.gain", 20))
    other = loaded(config_file("ivu", {"try.py": law("return p.gain * e * 1.0")}, position=TRY))
    assert type(other) is not type(own)
    assert text != text_of(other)


def test_exception_of_the_law_trips(own):
    lines = text_of(own).splitlines()
    step = next(i for i, line in enumerate(lines) if "u_pd = own_try_" in line)
    assert [line.strip() for line in lines[step - 1 : step + 3]] == [
        "try:", lines[step].strip(), "except Exception:", "u_pd = np.nan"
    ]  # fmt: skip


@pytest.mark.parametrize("kind", ["ivu", "ldu", "axis"])
def test_user_law_can_be_given_as_a_single_word(config_file, law, kind):
    text = law(changes={"gain: float = quantity(": "gain: float = quantity(5.0, "})
    file = config_file(kind, {"try.py": text}, position="./try.py:Try")
    assert loaded(file).law.position.gain == 5.0
    assert loaded(file, "law=./try.py:Try").law.position.gain == 5.0


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("./tri.py:Try", "config.yaml:{}: law.position.kind: ./tri.py: no such file in .*; did you mean 'try.py'"),
        ("./try.py", "config.yaml:{}: law.position.kind: './try.py' should be a file and a name in it"),
        ("./try.py:Tri", r"config.yaml:{}: law.position.kind: ./try.py: there is no class TriSettings; did you mean "),
    ],
)
def test_error_in_a_user_law_reference_names_the_config_line(config_file, law, word, message):
    file = config_file("ivu", {"try.py": law()}, position={**TRY, "kind": word})
    at = 1 + next(i for i, line in enumerate(file.read_text().splitlines()) if word in line)
    with pytest.raises(UserError, match=message.format(at)):
        loaded(file)


def test_settings_of_a_user_law_are_validated_as_for_shipped_laws(config_file, law):
    file = config_file("ivu", {"try.py": law()}, position={"kind": "./try.py:Try"})
    with pytest.raises(UserError, match=r"law\.position: missing key 'gain' \(proportional gain, in V/rad\)"):
        loaded(file)
    with pytest.raises(UserError, match=r"--set law\.position\.gain=-1: -1 V/rad is out of bounds"):
        loaded(file, "law.position.gain=-1")


def test_plain_data_without_its_texts_is_refused(own):
    data = {**written(own), "own": {}}
    with pytest.raises(OwnError, match="its text is not in the config's `own`"):
        machines.settings(data)


def test_signal_of_another_machine_is_refused(config_file, law):
    text = law(changes={"step(p, s, e)": "step(p, s, e, R1)"})
    machines.build(loaded(config_file("ivu", {"try.py": text}, position=TRY)))
    with pytest.raises(OwnError, match="there is no signal 'R1' here"):
        machines.build(loaded(config_file("axis", {"try.py": text}, position=TRY)))


@pytest.mark.parametrize("kind", ["ivu", "ldu", "axis"])
def test_user_plant_is_connected_to_the_emulated_board(config_file, kind):
    file = config_file(
        kind, {"my_plant.py": (TEMPLATES / f"my_plant_{kind}.py").read_text()}, plant="./my_plant.py:MyPlant"
    )
    config = loaded(file)
    ast.parse(text_of(config))
    theirs = machines.build(loaded(Path(__file__).parents[2] / "configs" / f"{kind}.yaml"))
    assert machines.build(config).truth == theirs.truth
    assert config.plant.substep == theirs.config.plant.substep
    with pytest.raises(UserError, match=r"plant\.stiffness=3: unknown key"):
        loaded(file, "plant.stiffness=3")
    with pytest.raises(UserError, match="0 are the most"):
        loaded(file, "plant.physics=[{term: friction.viscous}]")


def test_plant_that_leaves_a_sensor_without_an_angle_is_refused(config_file):
    text = (TEMPLATES / "my_plant_ivu.py").read_text().replace("reel2=float, ", "")
    with pytest.raises(UserError, match=r"MY_PLANT_STATE has no 'reel2', which a sensor of the ivu looks at"):
        loaded(config_file("ivu", {"my_plant.py": text}, plant="./my_plant.py:MyPlant"))


def test_user_term_is_combined_with_library_terms(config_file):
    terms = [{"term": "friction.viscous", "node": "reel1", "B": 1e-5}, {"term": TERM, "node": "reel1", "c": 1e-5}]
    text = (TEMPLATES / "my_term.py").read_text()
    config = loaded(config_file("ivu", {"my_term.py": text}, plant={"physics": terms}))
    source = text_of(config)
    ast.parse(source)
    assert "_my_term_" in source and ".drag(p.term1," in source
    assert machines.settings(written(config)) == config
    with pytest.raises(UserError, match=rf"{TERM} cannot stand at 'reel3' of the ivu; did you mean 'reel2'"):
        set_path(config, "plant.physics.1.node", "reel3")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("MY_TERM = Term", "TERM = Term", "there is no term MY_TERM; did you mean ./my_term.py:TERM"),
        ('act={"force"', 'act={"push"', "there is no site 'push'; it is command, force, last, reading"),
        ('stand("body")', 'stand("gear")', "there is no element 'gear'; there is body, joint, drive, sensor, loop"),
        ('stand("body")', 'stand("body", "lone")', "a body has no trait 'lone'; its traits are turns, slides"),
        (
            'stand("body")',
            'stand("body", "reel slides")',
            "no machine has an element for it; it asks for",
        ),
        ("    node: str\n", "", "MyTermSettings has no key `node`"),
    ],
)
def test_user_term_that_does_not_fit_is_refused(config_file, old, new, message):
    text = (TEMPLATES / "my_term.py").read_text()
    assert old in text
    file = config_file(
        "ivu", {"my_term.py": text.replace(old, new)}, plant={"physics": [{"term": TERM, "node": "reel1"}]}
    )
    with pytest.raises(UserError, match=message):
        loaded(file)


def test_changed_text_of_a_user_law_needs_a_restart(own, config_file, law):
    fresh = loaded(config_file("ivu", {"try.py": law("return p.gain * e * 2.0")}, position=TRY))
    with pytest.raises(UserError, match=r"own: \./try\.py is another text now; restart the machine"):
        reload(SimpleNamespace(config=own), fresh)


def test_user_term_that_does_not_compile_is_refused(config_file):
    text = (TEMPLATES / "my_term.py").read_text().replace("return -p.c * v", "return -p.cc * v")
    terms = [{"term": TERM, "node": "reel1", "c": 1e-5}]
    config = loaded(config_file("ivu", {"my_term.py": text}, plant={"physics": terms}))
    with pytest.raises(UserError, match=r"\./my_term\.py:36: p\.cc: MyTermParams has no 'cc'; did you mean p\.c\?"):
        verdicts(machines.build(config))
