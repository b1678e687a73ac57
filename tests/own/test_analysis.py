"""Analysis of machines with user files: a user plant is refused; the code of a user law or term is not needed."""

import copy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from rtctl_config import TEMPLATES, loaded

from rtctl.case.format1 import read_case
from rtctl.cli import identify_source
from rtctl.config.errors import UserError
from rtctl.design import response
from rtctl.diagnose.answer.format1_config import read_model
from rtctl.identify import records
from rtctl.own.files import refuse_plant
from rtctl.trace.bundle import Bundle

CONFIGS = Path(__file__).parents[2] / "configs"
KINDS = ("ivu", "ldu", "axis")
PLANT = "./my_plant.py:MyPlant"
WORKS = ("replay", "trace plot", "trace compare", "trace export", "not there yet")


def bundle(kind: str, **parts) -> Bundle:
    """A bundle without rows; its config is the shipped one with replaced parts."""
    data = yaml.safe_load((CONFIGS / f"{kind}.yaml").read_text())
    for key, value in parts.items():
        data[key] = {**data.get(key, {}), **value}
    return Bundle({"t": np.zeros(2)}, {"plant": kind, "config": data}, Path("mine"), {})


@pytest.mark.parametrize("kind", KINDS)
def test_recording_with_a_user_plant_is_refused_with_a_remedy(kind):
    made = bundle(kind, plant={"kind": PLANT})
    for analysis in (records.config_of, lambda b: read_case(b.case, b.folder)):
        with pytest.raises(UserError, match=r"case\.json: config\.plant\.kind is './my_plant\.py:MyPlant'") as error:
            analysis(made)
        assert all(words in str(error.value) for words in WORKS)


@pytest.mark.parametrize("plant", [PLANT, {"kind": PLANT}])
def test_short_form_of_a_user_plant_is_refused(plant):
    with pytest.raises(UserError, match="a plant of the user's own"):
        refuse_plant({"plant": plant})
    refuse_plant({"plant": {"kind": "ivu"}})
    refuse_plant(None)


@pytest.mark.parametrize("kind", KINDS)
def test_config_with_a_user_plant_has_no_model_and_no_response(config_file, kind):
    file = config_file(kind, {"my_plant.py": (TEMPLATES / f"my_plant_{kind}.py").read_text()}, plant=PLANT)
    config = loaded(file)
    for analysis in (
        lambda: response.take(config),
        lambda: read_model(file, SimpleNamespace(plant=kind)),
        lambda: identify_source.records([str(file)], None, None, True, lambda _: []),
    ):
        with pytest.raises(UserError, match="a plant of the user's own") as error:
            analysis()
        assert all(words in str(error.value) for words in WORKS)


@pytest.mark.parametrize("kind", KINDS)
def test_code_of_a_user_law_or_term_is_not_needed(tmp_path, kind):
    marker = tmp_path / "ran"
    text = f"open({str(marker)!r}, 'w').close()\n"
    made = bundle(
        kind,
        law={"position": {"kind": "./my_law.py:MyLaw", "gain": 3}},
        plant={"physics": [{"term": "./my_term.py:MyTerm", "node": "drive", "c": 1.0}]},
        record={"trace": ["position.n"]},
        own={"./my_law.py": text, "./my_term.py": text},
    )
    before = copy.deepcopy(made.case)
    config = records.config_of(made)
    assert config.machine == kind and not config.plant.physics and not marker.exists()
    assert config.law.limit == records.config_of(bundle(kind)).law.limit
    assert made.case == before
