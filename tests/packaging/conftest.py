"""Fixtures: sdist, wheel of the tree and wheel of the sdist, built once without network."""

import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
LEFT = {".git", ".venv", "build", "dist", "runs", "rtctl.egg-info"}
BUILD = "import sys, setuptools.build_meta as b; print(getattr(b, sys.argv[1])(sys.argv[2]))"


class Built(NamedTuple):
    sdist: Path
    source: Path  # the sdist, unpacked
    wheel: Path  # of the tree
    again: Path  # of the sdist


def names(archive: Path) -> set[str]:
    """Files in a wheel or an sdist, the latter without its top folder."""
    if archive.suffix == ".whl":
        return set(zipfile.ZipFile(archive).namelist())
    with tarfile.open(archive) as tar:
        return {m.name.partition("/")[2] for m in tar.getmembers() if m.isfile()}


def tracked() -> list[str]:
    """Files of the project: tracked files, and new files that are not ignored."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True
    )
    if listed.returncode == 0:
        return [name for name in listed.stdout.split("\n") if name and (ROOT / name).is_file()]
    files = (p.relative_to(ROOT) for p in ROOT.rglob("*") if p.is_file())  # an unpacked sdist
    return [str(f) for f in files if not LEFT & set(f.parts) and "__pycache__" not in f.parts]


def build(hook: str, source: Path, folder: Path) -> Path:
    """Build call of a front end such as pip, without an isolated environment."""
    folder.mkdir(parents=True, exist_ok=True)
    done = subprocess.run([sys.executable, "-c", BUILD, hook, str(folder)], cwd=source, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return folder / done.stdout.split("\n")[-2].strip()


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    import setuptools

    if int(setuptools.__version__.split(".")[0]) < 77:
        pytest.skip(f"setuptools {setuptools.__version__} is too old to build with; 77 is needed")
    folder = tmp_path_factory.mktemp("dist")
    tree = folder / "tree"
    for name in tracked():
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        (tree / name).symlink_to(ROOT / name)
    sdist = build("build_sdist", tree, folder / "sdist")
    with tarfile.open(sdist) as tar:
        tar.extractall(folder / "unpacked", filter="data")
    source = next((folder / "unpacked").iterdir())
    return Built(
        sdist, source, build("build_wheel", tree, folder / "wheel"), build("build_wheel", source, folder / "again")
    )


@pytest.fixture(scope="session")
def files() -> list[str]:
    return tracked()


@pytest.fixture(scope="session")
def held():
    return names
