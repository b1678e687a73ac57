"""Text of a user file in a bundle is never run."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest
from narrowed import only
from rtctl_config import loaded

from rtctl.api import record
from rtctl.cli.main import main
from rtctl.machines import CONFIGS
from rtctl.own import files
from rtctl.own.model import without_code
from rtctl.trace.bundle import load_case, save_case


def test_text_of_a_user_file_runs_only_if_the_file_is_named(tmp_path: Path) -> None:
    marker = tmp_path / "ran"
    source = files.Source("./law.py", "Law", f"open({str(marker)!r}, 'w').close()\n")
    with pytest.raises(files.ForeignError, match="--own"):
        files.load(source)
    assert not marker.exists()
    (tmp_path / "law.py").write_text(source.text)
    files.give([tmp_path / "law.py"])
    files.load(source)
    assert marker.exists()


ANALYSIS = {
    "diagnose": ["diagnose", "bundle", "--no-report"],
    "simulate": ["simulate", "case", "bundle"],
    "model": ["simulate", "bundle/diagnosis/model.yaml", "bundle"],
    "plot": ["trace", "plot", "bundle"],
    "compare": ["trace", "compare", "bundle", "bundle"],
    "info": ["trace", "info", "bundle"],
    "export": ["trace", "export", "bundle", "--to", "csv"],
    "repair": ["trace", "repair", "bundle"],
    "radius": ["identify", "radius", "bundle"],
    "steps": ["identify", "steps", "bundle"],
    "friction": ["identify", "friction", "bundle"],
}


class Own(NamedTuple):
    folder: Path
    marker: Path

    def ran(self) -> bool:
        return self.marker.exists()


@pytest.fixture
def bundle(
    tmp_path: Path, runtime: Path, config_file: Callable[..., Path], law: Callable[..., str],
    monkeypatch: pytest.MonkeyPatch,
) -> Own:  # fmt: skip
    """A recording under a user law; the text in case.json has an additional line."""
    only(monkeypatch, "friction.viscous")
    monkeypatch.chdir(tmp_path)
    file = config_file("ivu", {"try.py": law()}, position={"kind": "./try.py:Try", "gain": 20})
    steps = "reference={steps: [{at: 0.1, to: 1.0}]}"
    record(loaded(file, steps, "name=foreign"), 4.0, tmp_path / "bundle")
    case = load_case(tmp_path / "bundle")
    (name,) = case["config"]["own"]
    case["config"]["own"][name] += f"\nopen({str(tmp_path / 'ran')!r}, 'w').close()\n"
    (tmp_path / "foreign.py").write_text(case["config"]["own"][name])
    save_case(tmp_path / "bundle", case)
    return Own(tmp_path, tmp_path / "ran")


def test_analysis_keeps_a_user_law_as_data_and_omits_user_terms() -> None:
    data = {
        "machine": "ivu",
        "law": {"position": {"kind": "./a.py:A", "gain": 3}},
        "plant": {"physics": [{"term": "./b.py:B"}, {"term": "friction.viscous"}]},
    }
    model, plain = without_code(CONFIGS["ivu"], data)
    assert plain["law"] == data["law"] and plain["plant"]["physics"] == [{"term": "friction.viscous"}]
    assert model is not CONFIGS["ivu"]
    with pytest.raises(files.OwnError, match=r"./p.py:P: .* nothing of an own plant"):
        without_code(CONFIGS["ivu"], {"machine": "ivu", "plant": "./p.py:P"})


def test_no_command_runs_the_text_in_a_bundle(bundle: Own, capsys: pytest.CaptureFixture[str]) -> None:
    for name, words in ANALYSIS.items():
        code = main(words)
        said = capsys.readouterr().err
        assert not bundle.ran(), name
        assert "came with the data" not in said and code in (0, 3), f"{name}: {said}"
    assert main(["replay", "bundle"]) == 2 and not bundle.ran()
    assert main(["replay", "bundle", "--own", "try.py"]) == 2  # recorded text, not that of the bundle
    assert not bundle.ran()
    assert capsys.readouterr().err.count("replay bundle --own ./try.py") == 2
    assert main(["replay", "bundle", "--own", "foreign.py"]) == 0
    assert bundle.ran()
