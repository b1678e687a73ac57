"""Text of an own file that came with data is not run."""

from pathlib import Path

import pytest

from rtctl.own import files


def test_text_that_nobody_gave_is_not_run(tmp_path: Path) -> None:
    marker = tmp_path / "ran"
    source = files.Source("./law.py", "Law", f"open({str(marker)!r}, 'w').close()\n")
    with pytest.raises(files.ForeignError, match="--own"):
        files.load(source)
    assert not marker.exists()
    (tmp_path / "law.py").write_text(source.text)
    files.give([tmp_path / "law.py"])
    files.load(source)
    assert marker.exists()
