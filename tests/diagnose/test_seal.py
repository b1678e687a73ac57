import json
import stat

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.errors import UserError
from rtctl.diagnose.seal import canonical, close_seal, open_seal

ANSWER = {"name": "ivu", "physics": [{"term": "friction.stribeck", "node": "motor1", "F_s": 0.004}]}


def test_sealed_answer_is_read_back(tmp_path):
    digest = close_seal(tmp_path / "s.json", ANSWER)
    assert open_seal(tmp_path / "s.json") == (ANSWER, digest)


def test_seal_file_hides_the_answer_and_is_private(tmp_path):
    path = tmp_path / "s.json"
    close_seal(path, ANSWER)
    assert "stribeck" not in path.read_text()
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_salt_gives_equal_answers_different_hashes(tmp_path):
    assert close_seal(tmp_path / "a", ANSWER) != close_seal(tmp_path / "b", ANSWER)


def test_existing_seal_is_not_overwritten(tmp_path):
    close_seal(tmp_path / "s.json", ANSWER)
    with pytest.raises(UserError, match="exists already"):
        close_seal(tmp_path / "s.json", {})
    assert open_seal(tmp_path / "s.json")[0] == ANSWER
    with pytest.raises(UserError, match="cannot be written: No such file"):
        close_seal(tmp_path / "no" / "s.json", ANSWER)


def test_exchanged_answer_is_refused(tmp_path):
    close_seal(tmp_path / "a", ANSWER)
    close_seal(tmp_path / "b", {**ANSWER, "name": "ldu"})
    a, b = (json.loads((tmp_path / name).read_text()) for name in "ab")
    (tmp_path / "c").write_text(json.dumps({**a, "sealed": b["sealed"]}))
    with pytest.raises(UserError, match="is not what was sealed"):
        open_seal(tmp_path / "c")


@given(at=st.integers(0, 10_000), byte=st.integers(0, 255))
@settings(deadline=None, max_examples=100)
def test_changed_byte_is_refused_or_keeps_the_answer(tmp_path_factory, at, byte):
    path = tmp_path_factory.mktemp("s") / "s"
    close_seal(path, ANSWER)
    data = bytearray(path.read_bytes())
    data[at % len(data)] = byte
    path.write_bytes(bytes(data))
    try:
        assert open_seal(path)[0] == ANSWER  # for example in white space
    except UserError as error:
        assert str(path) in str(error)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not JSON"),
        ("[]", "has no 'sha256'"),
        ('{"sha256": "0", "salt": "1"}', "has no 'sealed'"),
        ('{"sha256": "0", "salt": "1", "sealed": "!!"}', "cannot be unpacked"),
        ('{"sha256": "0", "salt": "1", "sealed": "AAAA"}', "cannot be unpacked"),
    ],
)
def test_invalid_seal_files_are_refused(text, message, tmp_path):
    (tmp_path / "s").write_text(text)
    with pytest.raises(UserError, match=message):
        open_seal(tmp_path / "s")


def test_missing_seal_is_refused(tmp_path):
    with pytest.raises(UserError, match="is missing"):
        open_seal(tmp_path / "s")


def test_canonical_text_does_not_depend_on_key_order():
    assert canonical({"b": 1, "a": 2}) == canonical({"a": 2, "b": 1})
