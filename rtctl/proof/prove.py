"""Complete proof: generate and seal, diagnose, open the seal, score, report. Continues an interrupted run."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError
from rtctl.config.files import write_text
from rtctl.proof import report, seal
from rtctl.proof.batch import MACHINES_MIX, MIX

SCORES, REPORT, RESULT = "scores.json", "report.md", "diagnosis.json"
FAILED = "failed.json"  # file beside a case with its failure; the case is not tried again

Progress = Callable[[int, int], None]


def prepare(
    folder: Path | str,
    count: int,
    seed: int,
    plants: tuple[str, ...],
    jobs: int,
    heldout: bool,
    progress: Progress | None,
    machines: bool = False,
) -> str:
    """Generate and seal the cases unless the folder holds exactly these; returns the hash of the answers.

    With `machines` the cases are of described machines, and `plants` are topologies. Raises UserError where the folder
    holds other cases or its answers are not the sealed ones.
    """
    folder = Path(folder)
    mix = (MACHINES_MIX if machines else MIX).format(seed)
    if (folder / seal.SEAL).is_file():
        found = json.loads((folder / seal.SEAL).read_text("utf-8"))
        answers = seal.open_seal(folder)
        if answers.get("mix") != mix or len(answers["cases"]) != count:
            raise UserError(
                f"{folder} holds {len(answers['cases'])} cases of '{answers.get('mix')}'; name another --out"
            )
        return str(found["sha256"])
    if machines:
        from rtctl.proof.machines import generate as described

        described.generate(folder, count, seed, plants, progress, jobs, heldout)
    else:
        from rtctl.proof.generate import generate

        generate(folder, count, seed, plants, progress, jobs, heldout)
    return str(json.loads((folder / seal.SEAL).read_text("utf-8"))["sha256"])


def cases(folder: Path) -> list[Path]:
    return sorted(p for p in Path(folder).glob("case-*") if p.is_dir() and not p.name.endswith("-heldout"))


def diagnose_all(
    folder: Path | str, jobs: int = 1, progress: Progress | None = None, work: Any = None, limit: float | None = None
) -> None:
    """Diagnose every case without a recorded diagnosis or failure.

    A case may take `limit` s, by default the usual limit of a folder. `work` replaces the diagnosis in tests.
    """
    from rtctl.diagnose import folder as many

    every = cases(Path(folder))
    left = [c for c in every if not any((c / "diagnosis" / f).exists() for f in (RESULT, FAILED))]
    done = len(every) - len(left)
    tasks = [many.Task(c.name, c, c / "diagnosis") for c in left]
    jobs, longest = min(jobs, os.cpu_count() or 1), many.LIMIT if limit is None else limit
    for outcome in many.diagnose_all(tasks, jobs, longest, report=False, work=work or many.one):
        out = Path(folder) / outcome.name / "diagnosis"
        out.mkdir(exist_ok=True)
        if outcome.code:  # a failure of the tool is recorded, not raised
            write_text(out / FAILED, json.dumps({"error": outcome.message}) + "\n")
        write_text(out / "seconds.json", json.dumps(outcome.seconds) + "\n")
        done += 1
        if progress:
            progress(done, len(every))


def score_all(folder: Path | str) -> dict[str, Any]:
    """Open the seal, score, and write scores.json, report.md and two figures. Raises UserError for a broken seal."""
    from rtctl.proof import figures
    from rtctl.proof.score import score

    folder = Path(folder)
    answers = seal.open_seal(folder)
    diagnoses = diagnoses_of(folder)
    seconds: dict[str, float] = {}
    for bundle in cases(folder):
        took = _json(bundle / "diagnosis" / "seconds.json")
        if isinstance(took, float):
            seconds[bundle.name] = took
    result = score(answers, diagnoses, seconds=seconds)
    write_text(folder / SCORES, json.dumps(result, sort_keys=True, indent=1) + "\n")
    write_text(folder / REPORT, report.markdown(result, f"Concealed cases, {answers.get('mix')}"))
    figures.reliability(result, folder / "reliability.png")
    figures.confusion(result, folder / "confusion.png")
    return result


def diagnoses_of(folder: Path) -> dict[str, Any]:
    """Content of diagnosis.json by case; None where it is missing."""
    return {bundle.name: _json(bundle / "diagnosis" / RESULT) for bundle in cases(folder)}


def _json(path: Path) -> Any:
    try:
        return json.loads(path.read_text("utf-8"))
    except (OSError, ValueError):
        return None


def words(result: dict[str, Any]) -> str:
    """Main table of scores for a terminal."""
    rows = [[report._cell(x) for x in row] for row in report.summary(result)]
    width = max(len(row[0]) for row in rows)
    return "\n".join(f"{what:{width}}  {figure:>8}  {of:>5}" for what, figure, of in rows)
