"""A cache folder that others may write is refused."""

from pathlib import Path

import pytest

from rtctl.config import cache
from rtctl.config.errors import UserError


def test_a_folder_that_others_may_write_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o777)
    with pytest.raises(UserError, match="chmod go-w"):
        cache.check(tmp_path)
    tmp_path.chmod(0o700)
    assert cache.made(tmp_path / "a" / "b").stat().st_mode & 0o777 == 0o700
