"""Conversion of recordings in public repositories to plain CSV with column names, for the cases in `public/`.

    python examples/real/public.py CLONES OUT

CLONES holds the repositories as folders OWNER/NAME, cloned by the user. OUT is `../shared/data/public` for the tests.
Columns get names, milliseconds become seconds, and repeated rows of a logger faster than its readings are left out.
Nothing else is changed.
"""

import gzip
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np


class Source(NamedTuple):
    """Source of a recording, and its selected columns."""

    repository: str
    commit: str  # commit of the file
    file: str
    columns: dict[str, int]  # name -> column of the file
    every: int = 1  # keep the first of so many rows
    milliseconds: bool = False
    centred: str = ""  # column whose mean is subtracted


SOURCES = {
    "hydraulic_load": Source(
        "DanielMartensson/MataveID", "4a12ff216e937a550104102342254940b6153357", "data/HangingLoad.csv",
        {"t": 0, "ref": 1, "x": 2, "u": 3}, every=5,
    ),
    "hydraulic_motor": Source(
        "DanielMartensson/MataveID", "4a12ff216e937a550104102342254940b6153357", "data/MotorRotation.csv",
        {"t": 0, "u": 1, "speed": 2}, every=2,
    ),
    "ruler_arm": Source(
        "ryanGT/systemid", "fbfab3750040d9625ae057916f4c7292ad8e7d24", "example/2009-04-21/swept1-0-10hz.txt",
        {"t": 0, "ref": 2, "v": 3, "theta": 4, "a": 5},
    ),
    "piston_seal": Source(
        "EvaZillen/3D-printed-pneumatic-actuator", "6e0bcb4633bd53b2a8544cdbd497c4c06539afc7",
        "results_pneumatic-actuator/data/friction/Circle_5bar.csv", {"t": 0, "x": 4, "push": 6},
        milliseconds=True, centred="push",
    ),
    "micromouse": Source(
        "opatiny/micromouse", "fb04095df41c44db38a729673562b44b7b800f69", "matlab/data/testPid1.csv",
        {"t": 0, "speed": 2, "command": 3}, milliseconds=True,
    ),
}  # fmt: skip


def rows_of(text: str) -> np.ndarray:
    """Numbers (n, columns) of a text with any separator, without lines that do not begin with a number."""
    lines = [line.replace(",", " ").split() for line in text.splitlines()]
    return np.array([[float(cell) for cell in cells] for cells in lines if cells and cells[0][0] in "-0123456789"])


def prepared(source: Source, text: str) -> dict[str, np.ndarray]:
    """Columns (n,) of a recording by name."""
    table = rows_of(text)[:: source.every]
    out = {name: table[:, column] for name, column in source.columns.items()}
    if source.milliseconds:
        out["t"] = (out["t"] - out["t"][0]) / 1000.0
    if source.centred:
        out[source.centred] = out[source.centred] - out[source.centred].mean()
    return out


def main(clones: Path, out: Path) -> None:
    """Write every recording with a cloned repository, and print the missing repositories."""
    out.mkdir(parents=True, exist_ok=True)
    for name, source in SOURCES.items():
        file = clones / source.repository / source.file
        if not file.is_file():
            print(f"{name}: {file} is missing; git clone https://github.com/{source.repository}, {source.commit[:7]}")
            continue
        columns = prepared(source, file.read_text("utf-8-sig"))
        with gzip.open(out / f"{name}.csv.gz", "wt") as written:
            np.savetxt(written, np.stack(list(columns.values()), 1), "%.7g", ",", header=",".join(columns), comments="")
        print(f"{name}: {len(columns['t'])} rows")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
