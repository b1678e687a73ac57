"""Content of wheel and sdist."""

import re
import tomllib
import zipfile
from pathlib import Path

import rtctl

ROOT = Path(__file__).parents[2]
PLACES = {"drivers/": "rtctl/drivers/", "plants/": "rtctl/plants/", "configs/": "rtctl/configs/", "rtctl/": "rtctl/"}


def test_wheel_contains_the_whole_program(built, files, held):
    inside = held(built.wheel)
    wanted = {
        new + name.removeprefix(old)
        for name in files
        for old, new in PLACES.items()
        if name.startswith(old) and not name.endswith(".md")
    }
    assert wanted - inside == set()  # a package that pyproject.toml does not name, a data file without a pattern
    assert "rtctl/py.typed" in inside


def test_wheel_contains_units_man_page_and_licence(built, held):
    inside = {name.partition("/")[2] for name in held(built.wheel)}
    assert "data/share/man/man1/rtctl.1" in inside
    assert {f"data/share/rtctl/systemd/{file.name}" for file in (ROOT / "systemd").iterdir()} <= inside
    assert "licenses/LICENSE" in inside


def test_wheel_contains_third_party_licences(built, files, held):
    """A folder of third-party files contains its licence."""
    theirs = [name for name in files if re.search(r"/(vendor|vendored|static)/.*LICEN[CS]E", name)]
    assert {PLACES["rtctl/"] + name.removeprefix("rtctl/") for name in theirs} <= held(built.wheel)


def test_wheel_contains_nothing_else(built, held):
    for name in held(built.wheel):
        assert name.startswith(("rtctl/", f"rtctl-{rtctl.__version__}.")), name
        assert not name.endswith((".pyc", ".nbi", ".nbc")), name


def test_sdist_contains_all_files_of_the_project(built, files, held):
    left = {
        name for name in set(files) - held(built.sdist) if not name.startswith(".github/")
    }  # files of the repository host
    assert left <= {".gitignore", ".pre-commit-config.yaml", ".readthedocs.yaml"}


def test_wheel_of_the_sdist_equals_that_of_the_tree(built, held):
    assert held(built.again) == held(built.wheel)
    one, two = zipfile.ZipFile(built.wheel), zipfile.ZipFile(built.again)
    for name in held(built.wheel):
        if not name.endswith("/RECORD"):
            assert one.read(name) == two.read(name), name


def test_version_has_a_single_source(built):
    assert built.wheel.name.startswith(f"rtctl-{rtctl.__version__}-py3-none-any")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert "version" not in project and "version" in project["dynamic"]
    metadata = zipfile.ZipFile(built.wheel).read(f"rtctl-{rtctl.__version__}.dist-info/METADATA").decode()
    assert f"\nVersion: {rtctl.__version__}\n" in metadata and "\nLicense-Expression: MIT\n" in metadata


def test_change_log_has_known_versions_and_headings():
    text = (ROOT / "CHANGELOG.md").read_text()
    versions = re.findall(r"^## \[(.+?)\]", text, re.M)
    assert versions[0] == "Unreleased" or versions[0] == rtctl.__version__
    assert rtctl.__version__ in text
    assert set(re.findall(r"^### (\w+)", text, re.M)) <= {
        "Added", "Changed", "Deprecated", "Removed", "Fixed", "Security",
    }  # fmt: skip
