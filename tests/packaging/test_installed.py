"""The wheel in a fresh environment outside of the project, in a read-only folder."""

import os
import site
import stat
import subprocess
import sys
import venv
from pathlib import Path

import pytest


class Installed:
    """A fresh environment with the wheel and the libraries of the tests."""

    def __init__(self, folder: Path, wheel: Path):
        self.folder, self.bin = folder, folder / "env" / "bin"
        venv.create(folder / "env", with_pip=False, symlinks=True)
        self.packages = next((folder / "env" / "lib").glob("python*")) / "site-packages"
        # as plain paths: the .pth files in them, which hold the editable installation, are not read
        lines = sorted({path for path in (*site.getsitepackages(), *sys.path) if path.endswith("site-packages")})
        (self.packages / "zz_shared.pth").write_text(f"import sys; sys.path += {lines!r}\n")
        pip = [sys.executable, "-m", "pip", "--python", str(self.bin / "python"), "install", "--no-deps", "--quiet"]
        done = subprocess.run(
            [*pip, "--no-index", "--disable-pip-version-check", str(wheel)], capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr[-2000:]
        self.home = folder / "home"
        self.home.mkdir()

    def __call__(self, *command: str, **environment: str) -> subprocess.CompletedProcess[str]:
        given = {
            "HOME": str(self.home),
            "PATH": f"{self.bin}:/usr/bin:/bin",
            "OPENBLAS_NUM_THREADS": "1",
            **environment,
        }
        return subprocess.run(
            [str(self.bin / command[0]), *command[1:]],
            cwd=self.home,
            env=given | environment,
            capture_output=True,
            text=True,
        )


@pytest.fixture(scope="session")
def installed(built, tmp_path_factory):
    return Installed(tmp_path_factory.mktemp("installed"), built.wheel)


def test_installed_version_and_location(installed):
    said = installed("rtctl", "--version")
    assert (said.returncode, said.stderr) == (0, "")
    assert said.stdout.startswith("rtctl ")
    where = installed("python", "-c", "import rtctl; print(rtctl.__file__)").stdout
    assert where.startswith(str(installed.packages))


def test_installed_package_contains_the_configs(installed):
    said = installed("rtctl", "check", "ldu_printer", "--reference", "print_steps")
    assert (said.returncode, said.stdout.partition("\n")[0]) == (0, "ok")


def test_man_page_and_units_are_installed_below_the_prefix(installed):
    share = installed.folder / "env" / "share"
    assert (share / "man" / "man1" / "rtctl.1").read_text().startswith(".TH RTCTL 1")
    assert (share / "rtctl" / "systemd" / "rtctl@.service").is_file()


TINY = """
from rtctl.loop import generate
text = "from numba import njit\\nfrom rtctl.idiom import tick\\n\\n"
text += "@tick\\ndef twice(x):\\n    return 2.0 * x\\n\\n@njit(cache=True)\\ndef entry(x):\\n    return twice(x)\\n"
module = generate.load(generate.write_text("tiny", text))
assert module.entry(21.0) == 42.0
print(sum(module.entry.stats.cache_hits.values()))
"""


def test_read_only_installation_compiles_into_the_cache(installed, tmp_path):
    """The packages stay unchanged, and the second process finds the compiled code of the first."""
    before = tree(installed.packages)
    folders = [p for p in (installed.packages, *installed.packages.rglob("*")) if p.is_dir()]
    for folder in folders:
        folder.chmod(stat.S_IRUSR | stat.S_IXUSR)  # root can write anyway, hence the comparison
    try:
        runs = [installed("python", "-B", "-c", TINY, RTCTL_CACHE_DIR=str(tmp_path / "cache")) for _ in range(2)]
    finally:
        for folder in folders:
            folder.chmod(0o755)
    assert [(run.returncode, run.stdout, run.stderr) for run in runs] == [(0, "0\n", ""), (0, "1\n", "")]
    kinds = {path.suffix for path in (tmp_path / "cache").rglob("*") if path.is_file()}
    assert kinds == {".py", ".nbi", ".nbc"}
    assert tree(installed.packages) == before


def tree(folder: Path) -> set[str]:
    return {os.path.relpath(p, folder) for p in folder.rglob("*") if "__pycache__" not in p.parts}
