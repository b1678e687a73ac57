"""Fixtures: real statuses of both machines, and a console of any width."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from rich.console import Console

from rtctl.cli.main import main
from rtctl.daemon.client import Client
from rtctl.terminal.panel import Panel
from rtctl.terminal.traces import Traces


class Picture(NamedTuple):
    """Arguments of a panel."""

    status: dict[str, Any]
    law: dict[str, Any]
    traces: Traces

    def panel(self, **changes: Any) -> Panel:
        more = {key: changes.pop(key) for key in ("left", "gone") if key in changes}
        return Panel({**self.status, **changes}, self.law, self.traces, **more)


@pytest.fixture(params=["ivu", "ldu"], scope="module")
def picture(request: Any, served: Callable[..., Any], config: Callable[..., Any]) -> Picture:
    """A machine during a move to a setpoint."""
    machine = served(config(request.param))
    machine.bench.ask("arm")
    machine.run(1.0)
    traces = Traces(machine.signals())
    with Client(machine.endpoint) as client:
        client.call("setpoint", value=0.3 if request.param == "ivu" else 0.001)
    for _ in range(5):
        machine.run(0.1)
        traces.update(machine.report()["signals"])
    return Picture(machine.report(), machine.config.law.model_dump(mode="json"), traces)


@pytest.fixture
def draw() -> Callable[..., list[str]]:
    """`draw(renderable, width)`: lines for a terminal of the given width."""

    def drawn(what: Any, width: int, height: int = 50, encoding: str = "utf-8", **options: Any) -> list[str]:
        buffer = io.TextIOWrapper(io.BytesIO(), encoding, write_through=True)
        options = {"force_terminal": True, "color_system": None, **options}
        console = Console(width=width, height=height, file=buffer, **options)
        console.print(what)
        buffer.seek(0)
        return buffer.read().splitlines()

    return drawn


@pytest.fixture
def rtctl(runtime: Path, capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """`rtctl("run", "ivu")` returns exit code and output."""

    def call(*words: Any) -> tuple[int, str, str]:
        code = main([str(word) for word in words])
        return code, *capsys.readouterr()

    return call
