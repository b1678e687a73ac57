"""Where the chunks of a campaign are computed: in this process, in a pool of them here, or by a Dask scheduler.

All three give the same rows: a chunk depends on the plan and its number only.
"""

from collections.abc import Iterable, Iterator
from typing import Any

from rtctl import workers
from rtctl.campaign import cell
from rtctl.campaign.plan import Plan

MOST, TASKS = 5, 40  # chunks of a task of Dask, where so many tasks are left at least

Done = Iterator[tuple[int, list[dict[str, Any]]]]  # chunk, its rows


def compute(plan: Plan, chunks: Iterable[int], jobs: int, scheduler: str | None) -> Done:
    """Rows of each chunk, as they are done. Raises UserError where there is no such scheduler, PoolError."""
    if scheduler is not None:
        left = list(chunks)
        together = min(MOST, max(1, len(left) // TASKS))
        return workers.dask(cell.run_chunk, left, scheduler, plan.payload, plan.identity, together=together)
    return _here(plan, chunks) if jobs == 1 else _local(plan, list(chunks), jobs)


def _here(plan: Plan, chunks: Iterable[int]) -> Done:
    for chunk in chunks:
        yield chunk, [cell.run_row(plan, number) for number in plan.numbers(chunk)]


def _local(plan: Plan, chunks: list[int], jobs: int) -> Done:
    """A pool of processes. The first run is compiled here, so that they need not all do it."""
    if chunks:
        cell.run_row(plan, plan.numbers(chunks[0])[0])
    yield from workers.local(cell.run_chunk, chunks, jobs, plan.payload, plan.identity)
