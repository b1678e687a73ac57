"""Pools of workers: result rows are bit-exact for every pool."""

from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from typing import Any

import pytest

from rtctl import workers
from rtctl.campaign import pools
from rtctl.campaign.plan import Plan
from rtctl.config.errors import UserError

Make = Callable[..., Plan]
BROKEN = {"law.position.gain": [31, -3], "faults": [[], [{"fault": "encoder.freeze", "at": 0.6}]], "loop.seed": [1, 2]}


def here(made: Plan) -> dict[int, Any]:
    return dict(pools.compute(made, range(made.chunks), 1, None))


def test_process_pool_gives_bit_exact_rows(plan: Make) -> None:
    made = plan(matrix=BROKEN)
    assert dict(pools.compute(made, range(made.chunks), 2, None)) == here(made)


def test_dask_gives_bit_exact_rows(plan: Make) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask (distributed) is not installed")
    made = plan(matrix=BROKEN)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        assert dict(pools.compute(made, range(made.chunks), 1, cluster.scheduler_address)) == here(made)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nowhere", "smtp://127.0.0.1:1"])
def test_missing_dask_scheduler_is_an_error(plan: Make, monkeypatch: pytest.MonkeyPatch, address: str) -> None:
    pytest.importorskip("distributed", reason="Dask (distributed) is not installed")
    monkeypatch.setattr(workers, "PATIENCE", 0.3)
    with pytest.raises(UserError, match="no Dask scheduler answers"):
        list(pools.compute(plan(), [0], 1, address))


def test_missing_dask_error_names_the_package(plan: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(UserError, match=r"pip install 'rtctl\[dask\]'"):
        list(pools.compute(plan(), [0], 1, "tcp://127.0.0.1:8786"))


def test_dead_worker_is_an_error(plan: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    class Pool:
        def __init__(self, *_: Any) -> None: ...

        def submit(self, *_: Any) -> Any:
            future: Any = Future()
            future.set_exception(BrokenProcessPool("killed"))
            return future

        def shutdown(self, **_: Any) -> None: ...

    monkeypatch.setattr(workers, "ProcessPoolExecutor", Pool)
    with pytest.raises(workers.PoolError, match="what is done is kept"):
        list(pools.compute(plan(), [0, 1], 2, None))
