"""Cases of examples/real/cases.yaml as command lines."""

import os
from pathlib import Path
from typing import Any

import yaml

FOLDER = Path(__file__).parent
ROOT = FOLDER.parents[1]
DATA = Path(os.environ.get("REAL_DATA", ROOT.parent / "shared" / "data"))


def cases() -> dict[str, dict[str, Any]]:
    """Every case by its name."""
    return yaml.safe_load((FOLDER / "cases.yaml").read_text())


def missing(case: dict[str, Any]) -> str:
    """First missing recording of a case; "" where none is missing."""
    return next((recording for recording in case["recordings"] if not (DATA / recording).exists()), "")


def imports(case: dict[str, Any], out: Path) -> list[list[str]]:
    """Arguments of `rtctl import` for each recording with a description; the bundles go into `out`."""
    lines = []
    for recording in case["recordings"]:
        machine = machine_of(case, recording)
        if machine is None:
            continue
        source = DATA / recording
        file = source / "recording.parquet" if source.is_dir() else source
        words = ["import", str(file), "--machine", str(FOLDER / machine), "-o", str(bundle(case, recording, out))]
        if case.get("map"):
            words += ["--map", ",".join(f"{ours}={theirs}" for ours, theirs in case["map"].items())]
        for ours, unit in case.get("unit", {}).items():
            words += ["--unit", f"{ours}={unit}"]
        lines.append([*words, *case.get("import", [])])
    return lines


def diagnosis(case: dict[str, Any], out: Path) -> list[str]:
    """Arguments of `rtctl diagnose`, run in FOLDER; the results go into `out`/diagnosis."""
    bundles = [str(bundle(case, recording, out)) for recording in case["recordings"]]
    together = ["--together"] if len(bundles) > 1 else []
    return ["diagnose", *bundles, *together, "-o", str(out / "diagnosis"), *case.get("options", [])]


def machine_of(case: dict[str, Any], recording: str) -> str | None:
    """Description of a recording; None for a bundle, which includes its description."""
    machine = case.get("machine")
    return machine[stem(recording)] if isinstance(machine, dict) else machine


def bundle(case: dict[str, Any], recording: str, out: Path) -> Path:
    """Path of the bundle of a recording, existing or to be imported."""
    return DATA / recording if machine_of(case, recording) is None else out / stem(recording)


def stem(recording: str) -> str:
    """Name of a recording without folder and suffix."""
    return Path(recording).name.partition(".")[0]
