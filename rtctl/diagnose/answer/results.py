"""Files of a diagnosis on disk: their names, and writing each whole or not at all."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError
from rtctl.config.files import made_in, replaced_path

RESULT, MODEL, EXPERIMENT, REPORT = "diagnosis.json", "model.yaml", "experiment.yaml", "report.html"
TURN = "torque_over_turn.csv"  # of an axis that turns
FOLDER = "diagnosis"  # default folder of the files in a bundle


def fresh(folder: Path, base: Path | None) -> None:
    """Make the folder and remove files of an earlier diagnosis. Where `base` is given, no link may lead out of `base`.

    Raises UserError where the disk does not take the folder.
    """
    try:
        if base is not None:
            made_in(base, *folder.relative_to(base).parts)
        folder.mkdir(parents=True, exist_ok=True)
        for name in (RESULT, MODEL, EXPERIMENT, TURN, REPORT):
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise UserError(f"{folder} cannot be written to: {error.strerror}") from None


def put(path: Path, make: Callable[[Path], Any]) -> None:
    """Write the file at `path`, whole or not at all. Raises UserError where the disk does not take the file."""
    try:
        with replaced_path(path) as part:
            make(part)
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror}") from None


def finite(value: Any) -> Any:
    """Plain data for JSON: None for a number that is not finite, Python numbers for those of numpy."""
    if isinstance(value, dict):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if hasattr(value, "tolist"):
        return finite(value.tolist())
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value
