"""Run of all parts of all chapters in parallel processes, with a progress line for each."""

import importlib
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

from rtctl.config.errors import NoAnswer, UserError, nearest
from rtctl.config.files import made_in
from rtctl.reproduce.rows import Part, Row, measured

MODULES = {  # chapter -> modules with its parts
    3: "chapter03", 4: "chapter04", 5: "chapter05", 6: "chapter06", 7: "chapter07", 8: "figures08", 9: "chapter09",
    10: "chapter10", 11: "figures11", 12: "figures12",
}  # fmt: skip
FOLDER = "images/reproduction"  # folder of the figures, beside the page


class Drawn(NamedTuple):
    """Saved figure."""

    number: str
    sentence: str
    file: str  # file name


class Result(NamedTuple):
    """Result of a part."""

    chapter: int
    title: str
    rows: list[Row]
    figures: list[Drawn]
    seconds: float


def parts(only: str | None = None) -> list[Part]:
    """Parts of all chapters; with `only` those of a chapter (8), a row (8.delay, delay) or a figure (8.3).

    Raises UserError where `only` matches nothing.
    """
    chapters = [int(only)] if only and only.isdigit() and int(only) in MODULES else list(MODULES)
    every = [
        part for chapter in chapters for part in importlib.import_module(f"{__package__}.{MODULES[chapter]}").PARTS
    ]
    if only is None or len(chapters) == 1:
        return every
    found = []
    for part in every:
        rows = tuple(row for row in part.rows if only in (row.name, row.name.partition(".")[2]))
        if rows or only in part.figures:
            found.append(part._replace(rows=rows or part.rows))
    if not found:
        names = [row.name for part in every for row in part.rows]
        near = nearest(only, [*names, *(name.partition(".")[2] for name in names)])
        hint = f"did you mean '{near}'?" if near else f"chapters {', '.join(map(str, MODULES))}, or the name of a row"
        raise UserError(f"--only {only}: no such chapter, row or figure; {hint}")
    return found


def reproduce(
    which: Sequence[Part], short: bool, out: Path | None, jobs: int = 1, say: Callable[[str], None] | None = None
) -> list[Result]:
    """Run parts and draw their figures into `out`/images/reproduction (None: no figures), `jobs` parts at a time.

    `say` gets a line after each part. Results are in the order of the parts.
    """
    folder = None if out is None else made_in(out, *FOLDER.split("/"))
    done: dict[int, Result] = {}

    def note(i: int, result: Result) -> None:
        done[i] = result
        if say:
            say(f"[{len(done)}/{len(which)}] {_words(result)}")

    if jobs == 1 or len(which) == 1:
        for i, part in enumerate(which):
            note(i, play(part, short, folder))
    else:
        with ProcessPoolExecutor(min(jobs, len(which)), get_context("spawn"), _alone) as pool:
            futures = {pool.submit(play, part, short, folder): i for i, part in enumerate(which)}
            try:
                for future in as_completed(futures):
                    note(futures[future], future.result())
            except BaseException:  # without cancellation, waiting parts would run to their end
                pool.shutdown(wait=False, cancel_futures=True)
                raise
    return [done[i] for i in range(len(which))]


def play(part: Part, short: bool, folder: Path | None) -> Result:
    """Rows and figures of a part. A failed experiment has no figure; its rows hold the reason."""
    begin = time.monotonic()
    rows, drawn = measured(part, short), []
    if folder is not None:
        from rtctl.reproduce.figures import save

        for number, draw in part.figures.items():
            try:
                picture = draw(short)
            except NoAnswer:
                continue
            drawn.append(Drawn(number, picture.sentence, save(picture.figure, folder, number).name))
    return Result(part.chapter, part.title, rows, drawn, time.monotonic() - begin)


def _alone() -> None:
    """Limit this process to one thread: there are as many processes as cores."""
    from threadpoolctl import threadpool_limits

    threadpool_limits(1)


def _words(result: Result) -> str:
    bad = sum(row.verdict == "fail" for row in result.rows)
    count = len(result.rows)
    passed = f"{bad} of {count} fail" if bad else f"{count} rows as stated" if count > 1 else "1 row as stated"
    return f"chapter {result.chapter}, {result.title}: {passed} ({result.seconds:.1f} s)"
