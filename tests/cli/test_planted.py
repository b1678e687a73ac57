"""Untrusted folders: no command writes through a symbolic link or reads the target of a link."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import small
from narrowed import only

from rtctl.api import load_config, record
from rtctl.cli.main import main
from rtctl.trace.bundle import CASE, PARQUET
from rtctl.trace.orders import ORDERS

IMPORT = ("import", "log.csv", "--plant", "axis", "--parameter", "M=1", "-o")
WRITERS = {  # in a folder with the bundles `recorded` and `imported`, log.csv, matrix.yaml
    "repair": ["trace", "repair", "recorded"],
    "plot": ["trace", "plot", "recorded"],
    **{f"export {to}": ["trace", "export", "recorded", "--to", to] for to in ("csv", "mat", "parquet", "mcap")},
    "import": [*IMPORT, "made"],
    "diagnose": ["diagnose", "imported", "--no-report"],
    "diagnose -o": ["diagnose", "imported", "--no-report", "-o", "found"],
    "simulate": ["simulate", "case", "recorded", "--plot", "simulated.png"],
    "compare": ["trace", "compare", "recorded", "recorded", "--plot", "compared.png"],
    "campaign": ["campaign", "run", "matrix.yaml", "-j", "1", "--out", "all"],
    "new": ["new", "law", "planted", "--into", "laws"],
    "identify": ["identify", "radius", "ivu", "--plot", "radius.png"],
    "reproduce": ["reproduce", "--only", "8.delay", "--short", "-j", "1", "--out", "pages"],
}


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("given")
    (folder / "matrix.yaml").write_text(small.MATRIX + "keep: {worst: 1}\n")
    small.log_of(folder)
    steps = {"steps": [{"at": 0.1, "to": 1.0}]}
    record(load_config("ivu", {"name": "planted", "loop.mode": "fused", "reference": steps}), 3.0, folder / "recorded")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main([*IMPORT, "imported"]) == 0
    return folder


@pytest.fixture
def call(runtime: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[list[str], Path], int]:
    """`call(words, folder)`: exit code of a command in a folder; searches and plots are stubbed."""
    only(monkeypatch, "load.spring")
    for name in ("overlay", "distributions", "along", "png"):
        monkeypatch.setattr(f"rtctl.campaign.figures.{name}", lambda *_: "")

    def run(words: list[str], folder: Path) -> int:
        monkeypatch.chdir(folder)
        return main(words)

    return run


def below(folder: Path) -> dict[str, bytes | None]:
    """Content of files by path; None for folders."""
    return {str(p.relative_to(folder)): None if p.is_dir() else p.read_bytes() for p in sorted(folder.rglob("*"))}


@pytest.mark.parametrize("name", WRITERS)
def test_no_command_writes_through_a_link_to_a_file(
    call: Callable[..., int], given: Path, tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    plain, planted, victims = (tmp_path / n for n in ("plain", "planted", "victims"))
    for folder in (plain, planted):
        shutil.copytree(given, folder)
    if name == "repair":
        for folder in (plain, planted):
            (folder / "recorded" / CASE).unlink()
    victims.mkdir()
    before = below(plain)
    assert call(WRITERS[name], plain) == 0, capsys.readouterr().err
    made = {path: text for path, text in below(plain).items() if before.get(path, ()) != text}
    assert made
    folders = {path for path, text in made.items() if text is None}
    for k, path in enumerate(made):
        for word in (path, f"{path}.tmp") if path not in folders else ():
            target = planted / word
            target.parent.mkdir(parents=True, exist_ok=True)
            target.unlink(missing_ok=True)
            (victims / f"{k}{target.suffix}").write_text("mine")
            target.symlink_to(victims / f"{k}{target.suffix}")
    code = call(WRITERS[name], planted)
    said = capsys.readouterr().err
    assert {path.read_text() for path in victims.iterdir()} == {"mine"}
    assert code in (0, 2) and "internal error" not in said, said


@pytest.mark.parametrize(
    ("name", "folder"),
    [
        ("diagnose", "imported/diagnosis"),
        ("diagnose many", "found/imported"),
        ("reproduce", "pages/images"),
        ("campaign", "all/parts"),
        ("campaign", "all/bundles"),
    ],
)
def test_no_command_writes_through_a_link_to_a_folder(
    call: Callable[..., int],
    given: Path,
    tmp_path: Path,
    name: str,
    folder: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    planted, victim = tmp_path / "planted", tmp_path / "victim"
    shutil.copytree(given, planted)
    if name == "campaign":
        assert call(WRITERS[name], planted) == 0
        shutil.rmtree(planted / "all" / "bundles")
        (planted / "all" / "results.parquet").unlink()
    victim.mkdir()
    (victim / "model.yaml").write_text("mine")
    (planted / folder).parent.mkdir(exist_ok=True)
    (planted / folder).symlink_to(victim)
    many = ["diagnose", ".", "--no-report", "--jobs", "1", "-o", "found"]
    assert call(WRITERS.get(name, many), planted) == 2
    assert below(victim) == {"model.yaml": b"mine"}
    assert "nothing is written there; remove the link" in "".join(capsys.readouterr())


READERS = {
    "plot": ["trace", "plot", "read"],
    "compare": ["trace", "compare", "read", "recorded"],
    "info": ["trace", "info", "read"],
    "export": ["trace", "export", "read", "--to", "csv"],
    "repair": ["trace", "repair", "read"],
    "replay": ["replay", "read"],
    "diagnose": ["diagnose", "read"],
    "heldout": ["diagnose", "imported", "--heldout", "read"],
    "simulate": ["simulate", "case", "read"],
    "identify": ["identify", "radius", "read"],
    "identify steps": ["identify", "steps", "read"],
}


@pytest.mark.parametrize(
    ("name", "file"),
    [*((name, file) for name in READERS for file in (PARQUET, CASE)), ("replay", ORDERS), ("info", ORDERS)],
)
def test_target_of_a_link_in_a_bundle_is_not_read(
    call: Callable[..., int], given: Path, tmp_path: Path, name: str, file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for bundle, source in {"recorded": "recorded", "read": "recorded", "imported": "imported"}.items():
        shutil.copytree(given / source, tmp_path / bundle)
    shutil.move(tmp_path / "read" / file, tmp_path / file)
    (tmp_path / "read" / file).symlink_to(tmp_path / file)
    code = call(READERS[name], tmp_path)
    said = capsys.readouterr().err
    assert code == 2 and "outside of" in said, said
