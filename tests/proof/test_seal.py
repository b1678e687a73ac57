"""The seal detects any change of the answers."""

import json

import pytest

from rtctl.config.errors import UserError
from rtctl.proof import seal

ANSWERS = {"cases": {"case-0001": {"kind": "null", "ratio": 0.0}}, "format": 1, "mix": "proof seed 1"}


def test_sealed_answers_are_read_back(tmp_path):
    sha = seal.close_seal(tmp_path, ANSWERS)
    assert len(sha) == 64
    assert seal.open_seal(tmp_path) == ANSWERS


def test_seal_does_not_depend_on_key_order_and_spaces(tmp_path):
    seal.close_seal(tmp_path, ANSWERS)
    (tmp_path / seal.ANSWERS).write_text(json.dumps(dict(reversed(ANSWERS.items()))))
    assert seal.open_seal(tmp_path) == ANSWERS


def test_changed_answer_is_refused(tmp_path):
    seal.close_seal(tmp_path, ANSWERS)
    path = tmp_path / seal.ANSWERS
    path.write_text(path.read_text().replace("null", "single", 1))
    with pytest.raises(UserError, match="not what was sealed"):
        seal.open_seal(tmp_path)


def test_salt_gives_equal_answers_different_hashes(tmp_path):
    (tmp_path / "b").mkdir()
    assert seal.close_seal(tmp_path, ANSWERS) != seal.close_seal(tmp_path / "b", ANSWERS)


@pytest.mark.parametrize(("name", "text"), [("seal.json", "{}"), ("seal.json", "["), ("answers.json", "[]")])
def test_error_names_the_damaged_file(tmp_path, name, text):
    seal.close_seal(tmp_path, ANSWERS)
    (tmp_path / name).write_text(text)
    with pytest.raises(UserError, match=name):
        seal.open_seal(tmp_path)


def test_missing_seal_is_refused(tmp_path):
    with pytest.raises(UserError, match="missing"):
        seal.open_seal(tmp_path)
