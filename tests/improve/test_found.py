"""Models and diagnoses as inputs of an improvement."""

import json

import pytest

from rtctl.config.errors import UserError
from rtctl.config.load import to_yaml
from rtctl.diagnose.evidence.diagnosis import Interval
from rtctl.improve import found


def test_model_file_gives_its_effects(with_sizes, tmp_path):
    (tmp_path / "any.yaml").write_text(to_yaml(with_sizes(dry=3.0)))
    read = found.load(tmp_path / "any.yaml", None, None)
    assert [effect.entry.term for effect in read.effects] == ["drive.deadband", "friction.coulomb", "load.spring"]
    dry = read.effects[1]
    assert dry.ends == ({"F_C": pytest.approx(2.7)}, {"F_C": pytest.approx(3.3)})
    assert not read.unnamed


def test_diagnosis_gives_the_intervals_of_the_effects(with_sizes, tmp_path):
    folder = tmp_path / "bundle" / "diagnosis"
    folder.mkdir(parents=True)
    (folder / "model.yaml").write_text(to_yaml(with_sizes(dry=3.0)))
    size = Interval(3.0, 2.5, 3.2, "N").as_json()
    told = {
        "verdict": "named",
        "effects": [{"name": "friction.coulomb", "node": "carriage", "parameters": {"F_C": size}}],
    }
    (folder / "diagnosis.json").write_text(json.dumps(told))
    for path in (tmp_path / "bundle", folder, folder / "model.yaml"):
        effect = found.load(path, None, None).effects[1]
        assert effect.ends == ({"F_C": 2.5}, {"F_C": 3.2})
        assert effect.interval == "F_C 3, 90 % 2.5 to 3.2 N"


def test_law_comes_from_the_given_config(with_sizes, tmp_path):
    (tmp_path / "model.yaml").write_text(to_yaml(with_sizes(dry=3.0)))
    read = found.load(tmp_path / "model.yaml", "configs/machines/belt.yaml", None)
    assert read.config.law.position.gain == 4.55 and len(read.effects) == 3
    with pytest.raises(UserError, match="is of another kind of machine"):
        found.load(tmp_path / "model.yaml", "ivu", None)


@pytest.mark.parametrize(("name", "match"), [
    ("nowhere", "no such file or folder"), ("empty", r"no model\.yaml in it; `rtctl diagnose"),
])  # fmt: skip
def test_path_without_a_model_is_refused(name, match, tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match=match):
        found.load(tmp_path / name, None, None)
