"""Import isolation: no command and no child process imports modules from the current folder."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from rtctl.trace.bundle import CASE, PARQUET

OURS = {"rtctl", "__main__"}
INSTALLED = {
    "sitecustomize", "usercustomize", "numpy", "scipy", "numba", "llvmlite", "pyarrow", "zmq", "yaml", "matplotlib",
    "pydantic", "typer", "click", "rich", "msgpack", "structlog", "jinja2", "pint", "platformdirs", "threadpoolctl",
    "distributed", "dask", "control",
}  # fmt: skip
SCRIPT = """\
import re
import sys
from rtctl.cli.main import main
if __name__ == "__main__":
    sys.exit(main())
"""  # entry script as written by pip


@pytest.fixture(scope="module")
def trapped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a decoy module for every import of Python and rtctl; an imported decoy leaves a file in `ran`."""
    folder = tmp_path_factory.mktemp("trapped")
    (folder / "ran").mkdir()
    for name in sorted({*sys.stdlib_module_names, *INSTALLED}):
        mark = f"import os\nopen(os.path.join({str(folder / 'ran')!r}, {name!r}), 'w').close()\n"
        (folder / f"{name}.py").write_text(mark)
    (folder / "matrix.yaml").write_text(
        yaml.safe_dump(
            {
                "campaign": "small",
                "config": "ivu",
                "seconds": 0.7,
                "set": {"reference": {"steps": [{"at": 0.1, "to": 1.0}]}},
                "matrix": {"law.position.gain": [25, 26]},
            }
        )
    )
    for name in ("a", "b"):  # short recordings: the workers end soon
        (folder / "bundles" / name).mkdir(parents=True)
        pq.write_table(pa.table({"t": np.arange(9) * 1e-3}), folder / "bundles" / name / PARQUET)
        (folder / "bundles" / name / CASE).write_text(json.dumps({"plant": "axis"}))
    return folder


@pytest.fixture
def call(trapped: Path, runtime: Path, tmp_path: Path) -> Callable[..., tuple[int, str]]:
    """`call("run", "ivu")`: exit code and stderr of the command, started in the decoy folder with a decoy `rtctl`.

    `module=True` starts the command as `python -m rtctl`, without the decoy `rtctl`.
    """
    script = tmp_path / "rtctl"
    script.write_text(SCRIPT)

    def run(*words: str, module: bool = False) -> tuple[int, str]:
        other = trapped / "rtctl"
        if not module and not other.exists():
            other.mkdir()
            (other / "__init__.py").write_text((trapped / "random.py").read_text().replace("'random'", "'rtctl'"))
        if module and other.exists():
            (other / "__init__.py").unlink()
            other.rmdir()
        environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONSAFEPATH", "NUMBA_CACHE_DIR")}
        command = [sys.executable, *(["-m", "rtctl"] if module else [str(script)]), *words]
        done = subprocess.run(command, cwd=trapped, env=environment, capture_output=True, text=True)
        return done.returncode, done.stderr

    return run


def ran(folder: Path) -> list[str]:
    return sorted(path.name for path in (folder / "ran").iterdir())


def test_campaign_pool_imports_nothing_from_the_current_folder(
    call: Callable[..., tuple[int, str]], trapped: Path
) -> None:
    code, said = call("campaign", "run", "matrix.yaml", "--jobs", "2", "--out", "campaign")
    assert (code, ran(trapped)) == (0, []), said


def test_diagnosis_workers_import_nothing_from_the_current_folder(
    call: Callable[..., tuple[int, str]], trapped: Path
) -> None:
    code, said = call("diagnose", "bundles", "--jobs", "2", module=True)
    assert (code, ran(trapped)) == (2, []) and "internal error" not in said, said


def test_loop_and_plant_import_nothing_from_the_current_folder(
    call: Callable[..., tuple[int, str]], trapped: Path
) -> None:
    name = f"trapped{os.getpid()}"
    code, said = call(
        "run", "ivu", "--mode", "lockstep", "--for", "0.1s", "--no-plot", "-o", "run", "--set", f"name={name}"
    )
    assert (code, ran(trapped)) == (0, []), said
