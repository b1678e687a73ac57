import shutil
import subprocess
from pathlib import Path

import pytest

from rtctl.manual.man_page import escape, man_page

PAGE = Path(__file__).parents[2] / "docs" / "man" / "rtctl.1"


def test_packaged_man_page_agrees_with_the_commands():
    assert PAGE.read_text() == man_page(), f"write it again: python -m rtctl.manual {PAGE}"


def test_man_page_is_valid_roff():
    assert escape("--for -1") == "\\-\\-for \\-1"
    assert escape(".sh a\\b") == "\\&.sh a\\eb"
    assert "\n.SS rtctl run [OPTIONS] CONFIG\n" in man_page()


def test_man_renders_the_page():
    man = shutil.which("man")
    if man is None:
        pytest.skip("there is no man here")
    done = subprocess.run([man, "--warnings", "-E", "UTF-8", "-l", "-Tutf8", str(PAGE)], capture_output=True, text=True)
    if "No manual entry" in done.stderr or "groff" in done.stderr:
        pytest.skip("man has no groff here")
    assert done.returncode == 0 and done.stderr == ""
    assert "rtctl run ivu --for 12s --reference steps" in done.stdout
