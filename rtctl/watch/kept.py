"""Band of a healthy machine in a file: JSON, with a hash of the model by which it was learned."""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.config.files import write_text
from rtctl.watch.band import Band
from rtctl.watch.cusum import Thresholds
from rtctl.watch.windows import Shape

FORMAT = 1
MODEL = ("plant", "machine", "parameters", "sensors", "drive", "physics", "sample_rate", "delay_samples", "problem")


def identity(case: dict[str, Any], model: Path | None) -> str:
    """Hash of the model of a case, or of the config that replaces it. The hash does not include law and reference,
    since the model follows the recorded command."""
    said: dict[str, Any] = {key: case.get(key) for key in MODEL}
    config = case.get("config") or {}
    said["config"] = {key: config.get(key) for key in ("plant", "machine", "loop", "driver")}
    said["config"]["loop"] = (config.get("loop") or {}).get("rate")
    if model is not None:
        said["model"] = model.read_text("utf-8")
    return hashlib.sha256(json.dumps(said, sort_keys=True, default=str).encode()).hexdigest()


def save_band(path: Path, band: Band, said: str) -> None:
    """Write a band. Raises OSError where the disk does not take it."""
    data = {name: _plain(value) for name, value in band._asdict().items()}
    write_text(path, json.dumps({"format": FORMAT, "identity": said, "band": data}, indent=1) + "\n")


def load_band(path: Path, said: str) -> Band:
    """Read a band. Raises UserError where the file holds no band, or the band of another model."""
    try:
        found = json.loads(path.read_text("utf-8"))
        data = found["band"]
        if found["format"] != FORMAT:
            raise ValueError(f"format {found['format']}; {FORMAT} is known")
        limits = Thresholds(np.array(data["limits"][0], float), float(data["limits"][1]))
        shape = Shape(int(data["shape"][0]), int(data["shape"][1]), float(data["shape"][2]))
        kept: dict[str, Any] = {"limits": limits, "shape": shape, "sensors": tuple(map(str, data["sensors"])),
                "followed": tuple(map(int, data["followed"])),
                "whitening": [np.array(a, float) for a in data["whitening"]]}  # fmt: skip
        rest: dict[str, Any] = {
            name: float(value) if isinstance(value, int | float) else np.array(value, float)
            for name, value in data.items()
            if name not in kept
        }
        band = Band(**{**kept, **rest})
    except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
        raise UserError(f"{path} is no band of `rtctl watch` ({error}); remove it, and one is learned anew") from None
    if found.get("identity") != said:
        raise UserError(
            f"{path} is the band of another machine, config or model; give another --band, or remove the file and the "
            "band is learned anew"
        )
    return band


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
