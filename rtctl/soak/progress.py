"""Progress file of a soak: the state between two events, from which the soak resumes with identical results.

`progress.npz` holds every record of the loop, the emulated machine and the checker as bytes, and one JSON text. The
file is replaced atomically, so that there is always a complete one.
"""

import json
import zipfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.files import replaced
from rtctl.soak.checker import Checker, Violation
from rtctl.soak.events import Day
from rtctl.soak.rig import Fused

PROGRESS = "progress.npz"
SHARED = ("status", "mailbox", "ring")
OWN = ("p", "s", "c", "y", "m", "f", "tx", "rx", "rx_staged", "held", "staged", "pp", "ps")
COUNTS = ("events", "injected", "tripped", "recovered")


def _arrays(rig: Fused) -> dict[str, np.ndarray]:
    """Every record that a tick or a check changes, by name."""
    own = {name: getattr(rig.loop, name) for name in OWN}
    shared = {name: rig.segment[name] for name in SHARED}
    return {**own, **shared, "windows": rig.checker.w, "carry": rig.checker.s}


def identity(rig: Fused, day: Day) -> dict[str, Any]:
    """Values that must be equal for a soak to resume; its length may differ."""
    return {
        "config": rig.config.model_dump(mode="json"),
        "tick": rig.made.path.stem,
        "seed": day.seed,
        "faults": day.with_faults,
    }


def save(folder: Path, rig: Fused, day: Day, wall_s: float) -> None:
    """Write the progress file. Raises UserError where it cannot be written."""
    checker = rig.checker
    checker.flush()
    text = {
        "identity": identity(rig, day),
        "event": day.number,
        "ticks": rig.tick,
        "lost": rig.reader.lost,
        "moves": day.moves,
        "wall_s": wall_s,
        **{name: dict(getattr(day, name)) for name in COUNTS},
        "violations": [v.as_json() for v in checker.kept],
        "captures": checker.captures,
    }
    records: dict[str, Any] = {name: np.frombuffer(a.tobytes(), np.uint8) for name, a in _arrays(rig).items()}
    records["last"] = np.frombuffer(b"" if checker.last is None else checker.last.tobytes(), np.uint8)
    try:
        with replaced(folder / PROGRESS, "wb", sync=True) as file:
            np.savez(file, progress=np.frombuffer(json.dumps(text).encode(), np.uint8), **records)
    except OSError as error:
        raise UserError(f"{folder / PROGRESS}: cannot be written: {error.strerror}; --resume needs it") from error


def load(folder: Path, rig: Fused, day: Day) -> float:
    """Restore rig, checker and day from the progress file; returns the wall time spent so far, s.

    Raises UserError where the file is missing or belongs to another soak, NoAnswer where it is damaged.
    """
    path = folder / PROGRESS
    if not path.exists():
        raise UserError(f"{path} is missing; there is nothing to resume, leave out --resume")
    try:
        with np.load(path) as file:
            held = {name: file[name].tobytes() for name in file.files}
        text = json.loads(held["progress"])
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise NoAnswer(f"{path} cannot be read ({error}); start again without --resume") from error
    _compare(path, text["identity"], json.loads(json.dumps(identity(rig, day))))
    for name, array in _arrays(rig).items():
        array[...] = np.frombuffer(held[name], array.dtype).reshape(array.shape)
    _restore(rig.checker, text, held["last"])
    rig.reader.lost = text["lost"]
    day.number, day.moves = text["event"], text["moves"]
    for name in COUNTS:
        setattr(day, name, Counter(text[name]))
    return float(text["wall_s"])


def _restore(checker: Checker, text: dict[str, Any], last: bytes) -> None:
    checker.kept = [Violation(**v) for v in text["violations"]]
    checker.captures = list(text["captures"])
    checker.count = int(checker.carry["episodes"].sum())
    if last:
        checker.last = np.frombuffer(last, checker.made.row)[0]


def _compare(path: Path, then: dict[str, Any], now: dict[str, Any]) -> None:
    for name, words in (("seed", "--seed"), ("faults", "--faults"), ("config", "config"), ("tick", "version of rtctl")):
        if then[name] != now[name]:
            what = f" ({then[name]}, not {now[name]})" if name in ("seed", "faults") else ""
            raise UserError(f"{path} is of a soak with another {words}{what}; resume it as it was begun")
