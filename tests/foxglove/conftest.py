"""Fixtures: a viewer with the WebSocket protocol of Foxglove, and a machine."""

import contextlib
import json
import struct
from collections.abc import Callable, Iterator
from typing import Any

import pytest

pytest.importorskip("foxglove", reason="needs the extra foxglove: pip install 'rtctl[foxglove]'")
websockets = pytest.importorskip("websockets.sync.client", reason="needs the package websockets")

PATIENCE = 20.0  # s, timeout of an answer


class Viewer:
    """One connection. Source of the protocol: github.com/foxglove/ws-protocol, docs/spec.md."""

    def __init__(self, url: str):
        self._open = contextlib.ExitStack()
        self.socket = self._open.enter_context(
            websockets.connect(url, subprotocols=["foxglove.sdk.v1"], max_size=None, close_timeout=1)
        )
        self.channels: dict[str, dict[str, Any]] = {}
        self.told: list[dict[str, Any]] = []  # everything but rows
        self.rows: dict[str, list[tuple[int, dict[str, Any]]]] = {}  # topic -> (log time, message)

    def close(self) -> None:
        self._open.close()

    def until(self, enough: Callable[[], Any]) -> Any:
        """Receive until `enough()` is true; returns its value."""
        while not (found := enough()):
            self._take(self.socket.recv(PATIENCE))
        return found

    def subscribe(self, *topics: str) -> None:
        for topic in topics:
            self.until(lambda topic=topic: topic in self.channels)
        chosen = [self.channels[topic]["id"] for topic in topics]
        self._send("subscribe", subscriptions=[{"id": id, "channelId": id} for id in chosen])
        self.parameters()  # the answer confirms the earlier messages

    def parameters(self, *names: str) -> dict[str, Any]:
        """Values of parameters, of all if no names are given."""
        return self._ask("getParameters", parameterNames=list(names))

    def set(self, **values: Any) -> dict[str, Any]:
        """Set parameters (a__b for a.b); returns the resulting values."""
        parameters = [{"name": name.replace("__", "."), "value": value} for name, value in values.items()]
        return self._ask("setParameters", parameters=parameters)

    def said(self, op: str) -> list[dict[str, Any]]:
        return [message for message in self.told if message["op"] == op]

    def _ask(self, op: str, **fields: Any) -> dict[str, Any]:
        id = f"{len(self.told)}-{op}"
        self._send(op, id=id, **fields)
        answer = self.until(lambda: next((m for m in self.said("parameterValues") if m.get("id") == id), None))
        return {p["name"]: p["value"] for p in answer["parameters"]}

    def _send(self, op: str, **fields: Any) -> None:
        self.socket.send(json.dumps({"op": op, **fields}))

    def _take(self, message: str | bytes) -> None:
        if isinstance(message, str):
            found = json.loads(message)
            self.told.append(found)
            for channel in found.get("channels", []) if found["op"] == "advertise" else []:
                self.channels[channel["topic"]] = channel
            return
        op, id, at = struct.unpack_from("<BIQ", message)
        assert op == 1
        topic = next(name for name, channel in self.channels.items() if channel["id"] == id)
        self.rows.setdefault(topic, []).append((at, json.loads(message[13:])))


@pytest.fixture
def machine(served: Callable[..., Any], config: Callable[..., Any]) -> Any:
    """A running reel unit."""
    machine = served(config("ivu"))
    machine.bench.ask("arm")
    machine.run(1.0)
    return machine


@pytest.fixture
def bridged(machine: Any) -> Iterator[Callable[..., Any]]:
    """`bridge, viewer = bridged(rate=100, control=True)`."""
    from rtctl.daemon.client import Client
    from rtctl.foxglove.bridge import Bridge

    opened: list[Any] = []

    def make(rate: float | None = None, control: bool = False) -> tuple[Any, Viewer]:
        bridge = Bridge(Client(machine.endpoint), "127.0.0.1", 0, rate, control)
        viewer = Viewer(bridge.url)
        opened.extend((bridge, viewer))
        return bridge, viewer

    yield make
    for bridge, viewer in zip(opened[::2], opened[1::2], strict=True):
        viewer.close()
        bridge.__exit__(None, None, None)
