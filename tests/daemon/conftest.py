"""Fixtures: a command server in a thread, and a handler that records its requests."""

import errno
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import zmq

from rtctl.config.errors import UserError
from rtctl.daemon.server import CommandServer


class Echo:
    """Handler that returns its request; `stop` is refused, `reset` fails, the result of `signals` is too large."""

    def __init__(self) -> None:
        self.seen: list[tuple[str, Any]] = []

    def handle(self, op: str, args: Any) -> Any:
        self.seen.append((op, args))
        if op == "stop":
            raise UserError("not while a capture runs")
        if op == "reset":
            raise RuntimeError("boom")
        if op == "play":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "/data")
        if op == "signals":
            return {"names": ["x" * 1000] * 100}
        if op == "disarm":
            return None
        return {"op": op, "args": args.model_dump()}


@pytest.fixture
def echo() -> Echo:
    return Echo()


@pytest.fixture
def context() -> Iterator[zmq.Context]:
    context = zmq.Context()
    yield context
    context.destroy(linger=0)


@pytest.fixture
def serving(context: zmq.Context, echo: Echo) -> Callable[..., Any]:
    """`with serving(endpoint) as server:` answers in a thread until the block ends."""

    @contextmanager
    def serve(endpoint: str, **options: Any) -> Iterator[CommandServer]:
        server = CommandServer(endpoint, options.pop("handler", echo), options.pop("context", context), **options)
        done = threading.Event()

        def run() -> None:
            while not done.is_set():
                if server.socket.poll(20):
                    server.process()

        thread = threading.Thread(target=run)
        thread.start()
        try:
            yield server
        finally:
            done.set()
            thread.join()
            server.close()

    return serve


@pytest.fixture
def endpoint(tmp_path: Path) -> str:
    return f"ipc://{tmp_path}/c"
