"""Execution of the chunks of a campaign: in this process, in a local pool of processes, or by a Dask scheduler.

All three give equal rows: a chunk depends only on the plan and its number.
"""

from collections.abc import Iterable, Iterator
from typing import Any

from rtctl import workers
from rtctl.campaign import cell
from rtctl.campaign.plan import Plan

MOST, TASKS = 5, 40  # most chunks of a Dask task, and the number of tasks below which tasks get smaller

Done = Iterator[tuple[int, list[dict[str, Any]]]]  # chunk, its rows


def compute(plan: Plan, chunks: Iterable[int], jobs: int, scheduler: str | None) -> Done:
    """Rows of each chunk, in order of completion. Raises UserError for an unreachable scheduler, PoolError."""
    if scheduler is not None:
        left = list(chunks)
        together = min(MOST, max(1, len(left) // TASKS))
        return workers.dask(cell.run_chunk, left, scheduler, plan.payload, plan.identity, together=together)
    return _here(plan, chunks) if jobs == 1 else _local(plan, list(chunks), jobs)


def _here(plan: Plan, chunks: Iterable[int]) -> Done:
    for chunk in chunks:
        yield chunk, [cell.run_row(plan, number) for number in plan.numbers(chunk)]


def _local(plan: Plan, chunks: list[int], jobs: int) -> Done:
    """Rows of each chunk from a local pool. The first run compiles here, and the workers use its cache."""
    if chunks:
        cell.run_row(plan, plan.numbers(chunks[0])[0])
    yield from workers.local(cell.run_chunk, chunks, jobs, plan.payload, plan.identity)
