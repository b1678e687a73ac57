"""Scores of baseline methods on the concealed cases of `rtctl diagnose`.

    python benchmarks/diagnosis_baselines.py CASES [--out FOLDER] [--only METHOD ...] [--cases N] [--json]

CASES is a folder of bundles with answers.json, as `rtctl prove` writes it. Each method leaves its answers as
FOLDER/METHOD/case-XXXX/diagnosis.json and is scored as `rtctl prove` scores. Prints a table in Markdown.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # small matrices: more threads only wait for each other

from baselines import inverse_dynamics, sparse, whiteness  # noqa: E402
from baselines.form import diagnosis  # noqa: E402

from rtctl.config.errors import NoAnswer, UserError  # noqa: E402
from rtctl.diagnose.record.format1 import Record, load_record  # noqa: E402
from rtctl.proof.score import score  # noqa: E402
from rtctl.proof.seal import ANSWERS, SEAL, open_seal  # noqa: E402

METHODS: dict[str, tuple[str, Callable[[Record], dict[str, Any]]]] = {
    "inverse": ("inverse dynamics, least squares, BIC", inverse_dynamics.diagnose),
    "pysindy": ("PySINDy on smoothed states", sparse.diagnose),
    "whiteness": ("whiteness of the fitted model's error", whiteness.diagnose),
    "coulomb": ("always Coulomb", lambda record: diagnosis(record.plant, ["friction.coulomb"])),
}


def answers_of(folder: Path) -> dict[str, Any]:
    """Opened answers by case. Raises UserError where they are missing."""
    if (folder / SEAL).is_file():
        found = open_seal(folder)
    else:
        try:
            found = json.loads((folder / ANSWERS).read_text("utf-8"))
        except (OSError, ValueError) as error:
            raise UserError(f"{folder / ANSWERS} cannot be read ({error}); `rtctl prove` writes it") from None
    cases: dict[str, Any] = found.get("cases", found)
    return cases


def run(
    name: str, folder: Path, out: Path, cases: list[str], say: Callable[[str], None]
) -> tuple[dict[str, Any], float]:
    """Diagnoses by case, and median time of a case in s; cases that a method cannot process are missing."""
    method = METHODS[name][1]
    found, seconds = {}, []
    for case in cases:
        try:
            record = load_record(folder / case)
            began = time.monotonic()
            answer = method(record)
        except (UserError, NoAnswer) as error:
            say(f"{name} {case}: {error}")
            continue
        seconds.append(time.monotonic() - began)
        found[case] = answer
        (out / name / case).mkdir(parents=True, exist_ok=True)
        (out / name / case / "diagnosis.json").write_text(json.dumps(answer, indent=1) + "\n", "utf-8")
    return found, sorted(seconds)[len(seconds) // 2] if seconds else 0.0


def summary(result: dict[str, Any], seconds: float) -> dict[str, Any]:
    """Columns of a score for the table."""
    single, null, unknown, pair = (result[k] for k in ("single", "null", "unknown", "pair"))
    return {
        "cases": result["cases"], "right_name": single["top1"], "right_node": result["node_accuracy"],
        "named_precision": result["named_precision"], "false_alarm_rate": null["false_alarm_rate"],
        "false_name_rate": unknown["false_name_rate"], "both_of_a_pair": pair["exactly"],
        "seconds_a_case": round(seconds, 3),
    }  # fmt: skip


def table(rows: dict[str, dict[str, Any]]) -> str:
    """Markdown table with a row for each method."""
    heads = {
        "right_name": "right name", "right_node": "right node", "named_precision": "names that are right",
        "false_alarm_rate": "false alarms", "false_name_rate": "unknown given a name",
        "both_of_a_pair": "pair, exactly", "seconds_a_case": "s a case",
    }  # fmt: skip
    lines = ["| method | " + " | ".join(heads.values()) + " |", "| --- |" + " --- |" * len(heads)]
    for name, row in rows.items():
        if "skipped" in row:
            lines.append(f"| {METHODS[name][0]} | {row['skipped']} |" + " |" * (len(heads) - 1))
            continue
        cells = [_cell(key, row[key]) for key in heads]
        lines.append(f"| {METHODS[name][0]} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _cell(key: str, value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.2g}" if key == "seconds_a_case" else f"{100 * value:.0f} %"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="bundles with answers.json")
    parser.add_argument("--out", type=Path, help="folder of the diagnoses; default: a temporary folder")
    parser.add_argument("--only", nargs="+", choices=tuple(METHODS), default=list(METHODS))
    parser.add_argument("--cases", type=int, help="number of cases; default: all")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    given = parser.parse_args(argv)
    try:
        answers = answers_of(given.folder)
    except UserError as error:
        print(error, file=sys.stderr)
        return 2
    cases = sorted(answers)[: given.cases]
    rows: dict[str, dict[str, Any]] = {}
    with tempfile.TemporaryDirectory(prefix="rtb-") as scratch:
        for name in given.only:
            if name == "pysindy" and not sparse.available():
                rows[name] = {"skipped": "pysindy is not installed"}
                continue
            found, seconds = run(
                name, given.folder, given.out or Path(scratch), cases, lambda s: print(s, file=sys.stderr)
            )
            rows[name] = summary(score({c: answers[c] for c in cases}, found), seconds)
    if given.json:
        print(json.dumps(rows))
    else:
        print(f"{len(cases)} cases of {given.folder}\n\n{table(rows)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
