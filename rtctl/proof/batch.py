"""Parallel generation and sealing of concealed cases; an interrupted run continues where it stopped."""

import json
import os
import shutil
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError
from rtctl.config.files import write_text
from rtctl.proof import seal

PLANTS = ("ivu", "ldu", "axis")
MIX = "proof seed {0}"  # entry `mix` of answers.json for the plants
MACHINES_MIX = "proof of machines, seed {0}"
DRAFT = ".unsealed"  # answers of the cases written so far; deleted at sealing

Progress = Callable[[int, int], None]
Write = Callable[..., tuple[str, dict[str, Any]]]  # (folder, seed, number, which, heldout) -> name, answer


def batch(
    folder: Path, count: int, order: dict[str, Any], write: Write, task: tuple[int, tuple[str, ...], bool], mix: str,
    form: int, progress: Progress | None, jobs: int,
) -> Path:  # fmt: skip
    """Write `count` cases with `write`, their answers and the seal into `folder`, and return it.

    An interrupted run continues only with an equal `order`. `task` is (seed, which, heldout); `mix` and `form` go into
    answers.json. `progress` is called with the number of finished cases and `count`. Raises UserError for a folder with
    other cases and for `count` 0.
    """
    if count < 1:
        raise UserError(f"count is {count}; at least one case is needed")
    seed, which, heldout = task
    found = begin(folder, order)
    tasks = [(folder, seed, i, which, heldout) for i in range(count) if f"case-{i + 1:04d}" not in found]
    cases = {name: a for name, a in found.items() if int(name[5:]) <= count}

    def keep(name: str, answer: dict[str, Any]) -> None:
        cases[name] = answer
        if progress:
            progress(len(cases), count)

    if jobs <= 1:
        for one in tasks:
            keep(*write(*one))
    else:
        with ProcessPoolExecutor(min(jobs, os.cpu_count() or 1), mp_context=get_context("spawn")) as pool:
            for done in as_completed([pool.submit(write, *one) for one in tasks]):
                keep(*done.result())
    seal.close_seal(folder, {"cases": dict(sorted(cases.items())), "format": form, "mix": mix})
    shutil.rmtree(folder / DRAFT)
    return folder


def begin(folder: Path, order: dict[str, Any]) -> dict[str, Any]:
    """Answers by case of an interrupted run with the same order; starts a new run in an empty folder."""
    draft = folder / DRAFT
    if any(folder.glob("case-*")) and not (draft / "order.json").is_file():
        raise UserError(f"{folder} holds cases already; name another folder")
    if (draft / "order.json").is_file():
        begun = json.loads((draft / "order.json").read_text("utf-8"))
        if begun != order:
            raise UserError(f"{folder} holds cases of an interrupted run with {begun}; name another folder")
        return {path.stem: json.loads(path.read_text("utf-8")) for path in sorted(draft.glob("case-*.json"))}
    draft.mkdir(parents=True)
    write_text(draft / "order.json", json.dumps(order))
    return {}
