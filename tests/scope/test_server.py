"""Server of the scope with a stubbed daemon: published rows and command replies."""

import asyncio
import contextlib
import itertools
import json
import os
import threading

import aiohttp
import numpy as np
import pytest
import zmq

from rtctl.config.errors import UserError
from rtctl.config.load import get_path, set_path
from rtctl.daemon.rows import RowsOut
from rtctl.daemon.server import CommandServer, default_endpoint
from rtctl.scope.feed import Feed
from rtctl.scope.guard import Guard
from rtctl.scope.server import ABSENT, MOST_VIEWERS, STARTING, Scope

number = itertools.count(1)


class Daemon:
    """A stubbed daemon at 1 kHz in a thread: publishes ten rows every 10 ms and applies commands to its config.

    It answers while `answers` is set.
    """

    def __init__(self, config, row):
        self.config, self.row, self.seen = config, row, []
        self.answers = threading.Event()
        self.answers.set()
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._done.set()
        self._thread.join()

    def handle(self, op, args):
        self.seen.append((op, args))
        if op == "status":
            return {"name": self.config.name, "machine": "ivu", "pid": os.getpid(), "rate_hz": 1000.0, "state": "idle"}
        if op == "signals":
            return {"signals": [{"name": name, "unit": "", "help": ""} for name in self.row.names]}
        if op == "get":
            return {"value": get_path(self.config, args.path).model_dump(mode="json")}
        if op == "set":
            self.config = set_path(self.config, args.path, args.value)
        if op == "reset":
            raise UserError("not now")
        return {"tick": 7}

    def _run(self):
        context = zmq.Context()
        server = CommandServer(default_endpoint(self.config.name, "command"), self, context)
        out = RowsOut(default_endpoint(self.config.name, "rows"), self.config.name, self.row, context)
        rows = np.zeros(10, self.row)
        topic = self.config.name.encode()
        for first in itertools.count(0, 10):
            out.socket.send_multipart([topic, *([b"junk"] * (first // 10 % 3))])  # junk that the scope must ignore
            rows["tick"] = np.arange(first, first + 10)
            rows["t"] = rows["tick"] / 1000.0
            out.publish(rows)
            if self._done.wait(0.01):
                break
            if self.answers.is_set():
                server.process()
        out.close()
        server.close()
        context.destroy(linger=0)


@pytest.fixture
def daemon(runtime, config, rows):
    settings = config("ivu")
    with Daemon(settings, rows(0, 1).dtype) as running:
        yield running


def serving(daemon, folder, work, control=False, say=lambda _: None):
    """Run `work(scope, session)` with a server; the session has the token. `say` receives the waiting messages."""

    async def main():
        feed, guard = Feed(daemon.config.name), Guard(folder)
        scope = Scope(feed, guard, control)
        ready = asyncio.Event()
        server = asyncio.create_task(scope.serve(0, lambda _: ready.set(), say))
        waiting = asyncio.create_task(ready.wait())
        await asyncio.wait({server, waiting}, return_when=asyncio.FIRST_COMPLETED)
        try:
            async with aiohttp.ClientSession(
                f"http://127.0.0.1:{guard.port}", cookie_jar=aiohttp.CookieJar(unsafe=True)
            ) as session:
                assert (await session.get("/", params={"token": guard.token})).status == 200
                await asyncio.wait_for(work(scope, session), 30)
        finally:
            server.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await server
            feed.close()

    asyncio.run(main())


class Page:
    """WebSocket client with the behaviour of the page."""

    def __init__(self, socket):
        self.socket = socket

    async def until(self, kind, **wanted):
        """The next message of a kind that has these values; frames are drawn meanwhile."""
        while True:
            message = await self.socket.receive()
            if message.type is aiohttp.WSMsgType.BINARY:
                length = int.from_bytes(message.data[:4], "little")
                found = json.loads(message.data[4 : 4 + length])
                await self.socket.send_json({"op": "drawn"})
            else:
                assert message.type is aiohttp.WSMsgType.TEXT, message
                found = json.loads(message.data)
            if found["kind"] == kind and all(found.get(key) == value for key, value in wanted.items()):
                return found

    async def ask(self, op, **args):
        await self.socket.send_json({"op": op, "id": 1, "args": args})
        return await self.until("reply")

    async def look(self, **view):
        await self.until("hello", run=1)
        await self.socket.send_json({"op": "view", "view": {"signals": ["u"], "window": 0.5, **view}})


@contextlib.asynccontextmanager
async def page(scope, session):
    async with session.ws_connect("/stream", origin=f"http://127.0.0.1:{scope.guard.port}") as socket:
        yield Page(socket)


def test_two_viewers_get_frames_of_their_views_and_the_status(daemon, tmp_path):
    async def work(scope, session):
        async with page(scope, session) as one, page(scope, session) as two:
            await one.look()
            await two.look(signals=["v", "tick"])
            assert (await one.until("roll"))["names"] == ["u"]
            assert (await two.until("roll"))["names"] == ["v", "tick"]
            status = await one.until("status", viewers=2)
            assert (status["alive"], status["lost"], status["status"]["state"]) == (True, 0, "idle")

    serving(daemon, tmp_path, work)


@pytest.mark.parametrize("op", ["arm", "disarm", "reset", "play", "setpoint", "set"])
def test_read_only_server_refuses_every_command(daemon, tmp_path, op):
    async def work(scope, session):
        async with page(scope, session) as viewer:
            reply = await viewer.ask(op, value=1.0)
            assert not reply["ok"]
            assert "--control" in reply["error"]

    serving(daemon, tmp_path, work)
    assert {op for op, _ in daemon.seen} <= {"status", "signals", "get"}


def test_commands_with_control_are_judged_by_the_daemon(daemon, tmp_path):
    async def work(scope, session):
        async with page(scope, session) as viewer:
            assert (await viewer.ask("set", path="law.position.gain", value="30 V/rad"))["ok"]
            settings = (await viewer.until("hello", run=1))["settings"]
            while {row["path"]: row["value"] for row in settings}.get("law.position.gain") != 30.0:
                settings = (await viewer.until("hello"))["settings"]  # a change is sent to all pages
            refused = await viewer.ask("set", path="law.position.gain", value=-3.0)
            assert "law.position.gain: -3.0 V/rad is out of bounds: it must be at least 0 V/rad" in refused["error"]
            assert "'setpoint' needs the argument 'value'" in (await viewer.ask("setpoint"))["error"]
            assert (await viewer.ask("reset"))["error"] == "not now"
            for op in ("stop", "capture", "fault", "drop table", None, 7, ["arm"]):
                assert "may not ask" in (await viewer.ask(op))["error"]

    serving(daemon, tmp_path, work, control=True)
    assert daemon.config.law.position.gain == 30.0


@pytest.mark.parametrize(
    "text",
    [
        *("", "{", "[]", "7", "{" * 3000),
        '{"op": "set", "args": 3}',
        '{"op": "arm", "args": {"op": "x"}}',
        '{"op": "view"}',
        '{"op": "view", "view": {"window": NaN}}',
    ],
)
def test_every_message_is_answered(daemon, tmp_path, text):
    async def work(scope, session):
        async with page(scope, session) as viewer:
            await viewer.socket.send_str(text)
            assert not (await viewer.until("reply"))["ok"]
            assert (await viewer.until("status"))["alive"]

    serving(daemon, tmp_path, work, control=True)


@pytest.mark.parametrize(
    ("path", "headers", "message"),
    [
        ("/", {"Host": "evil.example:{port}"}, "is not this server"),
        ("/", {"Host": "127.0.0.1"}, "is not this server"),
        ("/", {"Origin": "http://evil.example"}, "is not this server's"),
        ("/stream", {"Origin": "http://evil.example"}, "is not this server's"),
        ("/stream", {"Origin": "http://127.0.0.1:1"}, "is not this server's"),
        ("/stream", {"Origin": "null"}, "is not this server's"),
        ("/stream", {"Origin": "http://evil.example:{port}", "Host": "evil.example:{port}"}, "is not this server"),
        ("/stream", {}, "without Origin"),
        ("/stream", {"Origin": "http://127.0.0.1:{port}", "Cookie": "rtctl_scope_{port}=guess"}, "?token="),
        ("/", {"Cookie": ""}, "?token="),
        ("/static/main.js", {"Cookie": ""}, "?token="),
    ],
)
def test_other_origins_and_wrong_tokens_are_refused(daemon, tmp_path, path, headers, message):
    async def work(scope, session):
        port = scope.guard.port
        asked = {"Host": f"127.0.0.1:{port}", "Cookie": f"{scope.guard.cookie}={scope.guard.token}"}
        asked |= {name: value.format(port=port) for name, value in headers.items()}
        upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13"}
        asked |= upgrade | {"Sec-WebSocket-Key": "c2l4dGVlbiBieXRlcyAuLg=="} if path == "/stream" else {}
        lines = "".join(f"{name}: {value}\r\n" for name, value in asked.items())
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(f"GET {path} HTTP/1.1\r\n{lines}\r\n".encode())
        answer = (await reader.read(2000)).decode()
        assert answer.startswith("HTTP/1.1 403 "), answer
        assert message in answer
        assert "frame-ancestors 'none'" in answer
        writer.close()

    serving(daemon, tmp_path, work, control=True)


def test_only_the_page_and_its_parts_are_served(daemon, tmp_path):
    async def work(scope, session):
        for path in ("/", "/static/main.js", "/static/uplot/uPlot.iife.min.js", "/static/uplot/LICENSE"):
            assert (await session.get(path)).status == 200
        for path in ("/static/../server.py", "/static/%2e%2e/server.py", "/static/", "/etc/passwd"):
            assert (await session.get(path)).status in (403, 404)

    serving(daemon, tmp_path, work)


def test_number_of_viewers_is_bounded(daemon, tmp_path):
    async def work(scope, session):
        async with contextlib.AsyncExitStack() as stack:
            for _ in range(MOST_VIEWERS):
                await stack.enter_async_context(page(scope, session))
            with pytest.raises(aiohttp.WSServerHandshakeError, match="503"):
                await stack.enter_async_context(page(scope, session))

    serving(daemon, tmp_path, work)


def test_scope_reconnects_to_a_new_daemon_of_the_name(runtime, config, rows, tmp_path, monkeypatch):
    settings = config("ivu")
    first, second = (Daemon(settings, rows(0, 1).dtype) for _ in range(2))

    async def work(scope, session):
        async with page(scope, session) as viewer:
            await viewer.look()
            await viewer.until("roll")
            first.__exit__()
            await viewer.until("status", alive=False)
            monkeypatch.setattr(os, "getpid", lambda: 4711)
            second.__enter__()
            await viewer.until("roll", restart=True)

    first.__enter__()
    try:
        serving(first, tmp_path, work)
    finally:
        first.__exit__()
        second._done.set()
        second._thread.join()


def test_scope_may_start_before_the_daemon(runtime, config, rows, tmp_path):
    """The daemon starts later. During its compilation the sockets exist, but requests are not answered."""
    late, said = Daemon(config("ivu"), rows(0, 1).dtype), []
    late.answers.clear()

    async def work(scope, session):
        async with page(scope, session) as viewer:
            assert (await viewer.until("hello"))["signals"] == []
            while not said:
                await viewer.until("status", alive=False, there=False)
            late.__enter__()
            await viewer.until("status", alive=False, there=True)
            while len(said) < 2:
                await viewer.until("status", alive=False)
            late.answers.set()
            await viewer.look()
            await viewer.until("roll")
        while len(said) < 3:
            await asyncio.sleep(0)

    try:
        serving(late, tmp_path, work, say=said.append)
    finally:
        late._done.set()
        late._thread.join()
    name = late.config.name
    assert said == [f"{name} {ABSENT}", f"{name} {STARTING}", f"{name} answers"]


def test_answering_daemon_gives_no_waiting_message(daemon, tmp_path):
    said = []

    async def work(scope, session):
        async with page(scope, session) as viewer:
            await viewer.look()
            await viewer.until("roll")

    serving(daemon, tmp_path, work, say=said.append)
    assert said == []


def test_port_in_use_is_an_error(daemon, tmp_path):
    async def work(scope, session):
        with pytest.raises(UserError, match="is in use; choose another"):
            await Scope(scope.feed, Guard(tmp_path)).serve(scope.guard.port)

    serving(daemon, tmp_path, work)
