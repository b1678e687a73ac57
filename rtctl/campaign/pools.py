"""Where the chunks of a campaign are computed: in this process, in a pool of them here, or by a Dask scheduler.

All three give the same rows: a chunk depends on the plan and its number only.
"""

import contextlib
import multiprocessing
import signal
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from rtctl.campaign import cell
from rtctl.campaign.plan import Plan
from rtctl.config.errors import UserError

PATIENCE = 10.0  # s for a scheduler to answer, and for its first worker
Done = Iterator[tuple[int, list[dict[str, Any]]]]  # chunk, its rows


class PoolError(Exception):
    """A worker died. What is done is kept."""


def compute(plan: Plan, chunks: Iterable[int], jobs: int, scheduler: str | None) -> Done:
    """Rows of each chunk, as they are done. Raises UserError where there is no such scheduler, PoolError."""
    if scheduler is not None:
        return _dask(plan, list(chunks), scheduler)
    return _here(plan, chunks) if jobs == 1 else _local(plan, list(chunks), jobs)


def _here(plan: Plan, chunks: Iterable[int]) -> Done:
    for chunk in chunks:
        yield chunk, [cell.run_row(plan, number) for number in plan.numbers(chunk)]


def _local(plan: Plan, chunks: list[int], jobs: int) -> Done:
    """A pool of processes. The first run is compiled here, so that they need not all do it."""
    if not chunks:
        return
    cell.run_row(plan, plan.numbers(chunks[0])[0])
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(jobs, len(chunks)), context, _quiet)
    try:
        futures = {pool.submit(cell.run_chunk, plan.payload, plan.identity, chunk): chunk for chunk in chunks}
        for future in as_completed(futures):
            yield futures[future], future.result()
    except BrokenProcessPool as error:
        raise PoolError("a worker process died (out of memory, or killed); what is done is kept") from error
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _quiet() -> None:
    """Ctrl-C is for the process that waits."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _dask(plan: Plan, chunks: list[int], scheduler: str) -> Done:
    try:
        from distributed import Client
        from distributed import as_completed as completed
    except ImportError as error:
        raise UserError("--scheduler needs Dask, which is not installed; pip install 'rtctl[dask]'") from error
    try:
        client = Client(scheduler, timeout=PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        raise UserError(f"--scheduler {scheduler}: no Dask scheduler answers there ({_first(error)})") from None
    with contextlib.closing(client):
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise UserError(f"--scheduler {scheduler}: it has no workers; start one with `dask worker`") from None
        payload = client.scatter(plan.payload, broadcast=True)
        futures = {client.submit(cell.run_chunk, payload, plan.identity, chunk, pure=False): chunk for chunk in chunks}
        try:
            for future in completed(futures):
                try:
                    yield futures[future], future.result()
                except (ImportError, AttributeError) as error:
                    raise UserError(
                        f"--scheduler {scheduler}: its workers cannot run this rtctl ({error}); install the same there"
                    ) from error
                except Exception as error:
                    if type(error).__name__ not in ("KilledWorker", "CancelledError", "CommClosedError"):
                        raise
                    raise PoolError(f"a Dask worker died ({_first(error)}); what is done is kept") from error
        finally:
            with contextlib.suppress(Exception):
                client.cancel(list(futures))


def _first(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
