import pytest

from rtctl.config.errors import UserError
from rtctl.scope.guard import kept_token


def test_token_is_persistent_and_readable_by_its_owner_only(tmp_path):
    path = tmp_path / "scope.token"
    token = kept_token(path)
    assert len(token) >= 32
    assert path.stat().st_mode & 0o777 == 0o600
    assert kept_token(path) == token
    assert kept_token(tmp_path / "other") != token


def test_token_readable_by_others_is_refused(tmp_path):
    path = tmp_path / "scope.token"
    kept_token(path)
    path.chmod(0o644)
    with pytest.raises(UserError, match="others can read"):
        kept_token(path)


def test_link_in_place_of_the_token_is_not_followed(tmp_path):
    (tmp_path / "scope.token").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(UserError, match=r"scope\.token: no file"):
        kept_token(tmp_path / "scope.token")
    assert not (tmp_path / "elsewhere").exists()
