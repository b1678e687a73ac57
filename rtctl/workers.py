"""Work that is computed here, in processes beside this one, or by the workers of a Dask scheduler.

All three give the same results: what a function returns depends on its arguments only. Results come as they are done.
"""

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from rtctl.config.errors import UserError

PATIENCE = 10.0  # s for a scheduler to answer, and for its first worker
DEAD = ("KilledWorker", "CancelledError", "CommClosedError")  # errors of Dask where a worker is gone

Results = Iterator[tuple[Any, Any]]  # item, what the function returned of it


class PoolError(Exception):
    """A worker died. What is done is kept."""


def cpus() -> int:
    """CPUs that this process may use."""
    return len(os.sched_getaffinity(0))


def local(function: Callable[..., Any], items: Sequence[Any], jobs: int, *shared: Any) -> Results:
    """Items with what `function(*shared, item)` returns, of `jobs` processes. Raises PoolError where one dies."""
    if not items:
        return
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(jobs, len(items)), context, _quiet)
    try:
        futures = {pool.submit(function, *shared, item): item for item in items}
        for future in as_completed(futures):
            yield futures[future], future.result()
    except BrokenProcessPool as error:
        raise PoolError("a worker process died (out of memory, or killed); what is done is kept") from error
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _quiet() -> None:
    """Ctrl-C is for the process that waits."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def dask(
    function: Callable[..., Any], items: Sequence[Any], scheduler: str, *shared: Any, together: int = 1
) -> Results:
    """The same of the workers of a Dask scheduler; `shared` is sent to each of them once, and a task is of so many
    items `together`: scheduler and client take a millisecond for each task, which two workers feel.

    Raises UserError where no scheduler answers, or it has no workers that can run this program, PoolError where a
    worker dies.
    """
    try:
        from distributed import Client
        from distributed import as_completed as completed
    except ImportError as error:
        raise UserError("--scheduler needs Dask, which is not installed; pip install 'rtctl[dask]'") from error
    try:
        client = Client(scheduler, timeout=PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        raise UserError(f"--scheduler {scheduler}: no Dask scheduler answers there ({first_line(error)})") from None
    with contextlib.closing(client):
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise UserError(f"--scheduler {scheduler}: it has no workers; start one with `dask worker`") from None
        sent = client.scatter(list(shared), broadcast=True) if shared else []
        tasks = [list(items[k : k + together]) for k in range(0, len(items), together)]
        futures = {client.submit(_several, function, task, *sent, pure=False): task for task in tasks}
        try:
            for future in completed(futures):
                try:
                    yield from zip(futures[future], future.result(), strict=True)
                except (ImportError, AttributeError) as error:
                    raise UserError(
                        f"--scheduler {scheduler}: its workers cannot run this rtctl ({error}); install the same there"
                    ) from error
                except Exception as error:
                    if type(error).__name__ not in DEAD:
                        raise
                    raise PoolError(f"a Dask worker died ({first_line(error)}); what is done is kept") from error
        finally:
            with contextlib.suppress(Exception):
                client.cancel(list(futures))


def _several(function: Callable[..., Any], items: Sequence[Any], *shared: Any) -> list[Any]:
    """What a function returns of each of some items, in a worker."""
    return [function(*shared, item) for item in items]


def first_line(error: Exception) -> str:
    """First line of an error's message, or its kind."""
    return (str(error).splitlines() or [type(error).__name__])[0]
