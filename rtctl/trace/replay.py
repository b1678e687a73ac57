"""Replay of a recording through its control law, and comparison of the outputs with the recorded outputs.

A recording from the first tick on holds all inputs of the law: sensor values, times of frames and lateness of ticks.
The journal beside it holds the orders. Therefore the same law writes the same voltages, to the bit.
"""

import hashlib
import shlex
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from rtctl import machines
from rtctl.config.complaints import sentences
from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import set_paths
from rtctl.loop import generate
from rtctl.loop.replay import Replay, read_columns, written_columns
from rtctl.own.files import ForeignError, OwnError, give
from rtctl.sources import sources_hash
from rtctl.trace.bundle import Bundle, load_bundle
from rtctl.trace.orders import orders, restore

ABSENT = {"watchdog": 0.0}  # values for columns missing in older recordings
GIVEN = ("tick", "t", "period", "lateness")  # inputs of the law in a row, beside the sensor values


class Difference(NamedTuple):
    """First difference of a signal between recording and replay."""

    column: str
    tick: int
    t: float  # s
    recorded: float
    replayed: float
    ticks: int  # number of ticks that differ
    largest: float


class Replayed(NamedTuple):
    """Result of a replay: `rows` (n,) of the replay and `recorded` (n,) of the recording."""

    bundle: Bundle
    recorded: np.ndarray
    rows: np.ndarray
    compared: tuple[str, ...]
    written: tuple[str, ...]  # columns that are written to the drives
    differences: tuple[Difference, ...]  # of each column that differs, ordered by first tick
    stopped: str  # why not all rows were replayed, "" for all
    changed: dict[str, Any]  # settings that differ from the recording
    same_program: bool  # whether the recording was made by the same sources

    @property
    def identical(self) -> bool:
        """Whether every column is identical to the bit."""
        return not self.differences


def replay(folder: Path | str, changed: Mapping[str, Any] | None = None, own: Iterable[Path | str] = ()) -> Replayed:
    """Replay the bundle in `folder`, with settings `changed` by their dotted path.

    `own` are paths of the user code that the recording was made with. Each text must equal the text in the bundle;
    code from the bundle never runs.

    Raises UserError for an invalid bundle or settings that do not fit, NoAnswer where inputs of the replay are missing.
    """
    bundle = load_bundle(folder)
    give(map(Path, own))
    return replay_bundle(bundle, changed)


def replay_bundle(bundle: Bundle, changed: Mapping[str, Any] | None = None) -> Replayed:
    """Replay a loaded bundle, as `replay` does."""
    config, changed = _config(bundle), dict(changed or {})
    config = set_paths(config, changed)
    machine = _machine(config)
    recorded, stopped = _rows(bundle, machine)
    told = orders(bundle.folder)
    made = Replay(machine)
    rows = np.empty(len(recorded), made.row)
    at = 0
    for number, count in _stretches(recorded["order"]):
        config = _obey(made, config, told, int(number), changed)
        rows[at : at + count] = made.over(recorded[at : at + count])
        at += count
    given = {*GIVEN, *read_columns(machine)}
    compared = tuple(name for name in made.row.names or () if name not in given)
    written = written_columns(machine)
    found = [_difference(name, recorded, rows) for name in compared]
    different = sorted((d for d in found if d is not None), key=lambda d: d.tick)
    same = bundle.case.get("versions", {}).get("sources") == sources_hash()
    return Replayed(bundle, recorded, rows, compared, written, tuple(different), stopped, changed, same)


def _config(bundle: Bundle) -> Any:
    """Settings at the start of the recording."""
    given = bundle.case.get("config")
    model = machines.class_of(given)
    if model is None or not isinstance(given, dict):
        raise NoAnswer(f"{bundle.folder}: its case has no rtctl `config`, so the law to replay is unknown")
    try:
        model, given = machines.widened(given)
        return model.model_validate(given)
    except OwnError as error:
        if isinstance(error.__cause__, ForeignError):
            raise UserError(_foreign(bundle, given)) from None
        raise UserError(f"{bundle.folder}/case.json, config: {error}") from error
    except ValidationError as error:
        raise UserError(f"{bundle.folder}/case.json, config: {sentences(error, model, given)}") from error


def _foreign(bundle: Bundle, given: dict[str, Any]) -> str:
    """Message for a recording made with user code that was not given."""
    told = given.get("own")
    texts = {name: text for name, text in (told if isinstance(told, dict) else {}).items() if isinstance(text, str)}
    words = " ".join(f"--own {shlex.quote(name)}" for name in texts)
    sums = ", ".join(f"{name} {hashlib.sha256(text.encode()).hexdigest()}" for name, text in texts.items())
    return (
        f"{bundle.folder} was recorded with user code, and rtctl never runs code from a bundle. Read the code "
        f"and give the files by path: rtctl replay {shlex.quote(str(bundle.folder))} {words}; their sha256 must be "
        f"that of the texts in case.json: {sums}"
    )


def _machine(config: Any) -> machines.Machine:
    try:
        return machines.build(config)
    except ValueError as error:
        raise UserError(f"{config.name}: {error}") from error


def _rows(bundle: Bundle, machine: machines.Machine) -> tuple[np.ndarray, str]:
    """Recorded rows (n,) up to the first missing row, and the reason for the end."""
    row = generate.row_dtype(machine)
    lacking = [name for name in row.names or () if name not in bundle.columns and name not in ABSENT]
    lacking = [name for name in lacking if name in (*GIVEN, *read_columns(machine), "order", "link_age")]
    if lacking:
        raise NoAnswer(f"{bundle.folder}: column '{lacking[0]}' is missing; a replay needs all that the law has read")
    ticks = bundle.columns["tick"].astype(np.int64)
    if ticks[0] != 0:
        raise NoAnswer(
            f"{bundle.folder} begins at tick {ticks[0]}: the state of the law at that tick is not recorded; "
            "replay the recording of the run itself, which begins at 0"
        )
    gaps = np.flatnonzero(np.diff(ticks) != 1)
    count = int(gaps[0]) + 1 if len(gaps) else len(ticks)
    rows = np.zeros(count, row)
    for name in row.names or ():
        rows[name] = bundle.columns[name][:count] if name in bundle.columns else ABSENT.get(name, np.nan)
    return rows, f"rows behind tick {ticks[count - 1]} are missing" if len(gaps) else ""


def _stretches(order: np.ndarray) -> list[tuple[float, int]]:
    """Run lengths of the column `order`: order in force and number of its rows."""
    starts = np.flatnonzero(np.diff(order, prepend=np.nan) != 0)
    return [(float(order[a]), int(b - a)) for a, b in zip(starts, [*starts[1:], len(order)], strict=True)]


def _obey(made: Replay, config: Any, told: dict[int, Any], number: int, changed: Mapping[str, Any]) -> Any:
    """Apply order `number` and the changes of earlier orders that no tick read; returns the settings in force."""
    last = int(made.c["order"][0])
    new = {path: value for n in range(last + 1, number + 1) if n in told for path, value in told[n].changed.items()}
    if number and number not in told:
        raise NoAnswer(f"order {number} is not in the journal: the recording cannot be replayed beyond it")
    if number:
        restore(made.c[0], told[number].command)
    new = {path: value for path, value in new.items() if path not in changed}
    if new:
        config = set_paths(config, new)
        made.use(_machine(config))
    return config


def _difference(name: str, recorded: np.ndarray, rows: np.ndarray) -> Difference | None:
    one, two = recorded[name], rows[name]
    other = one.view(np.int64) != two.view(np.int64)
    if not other.any():
        return None
    at = int(np.argmax(other))
    with np.errstate(invalid="ignore"):
        largest = float(np.nanmax(np.abs(one - two))) if np.isfinite(one - two).any() else float("nan")
    return Difference(
        name, int(rows["tick"][at]), float(rows["t"][at]), float(one[at]), float(two[at]), int(other.sum()), largest
    )
