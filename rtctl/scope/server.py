"""The scope's server: one page on loopback, frames to its viewers, and their commands where `control` is on."""

import asyncio
import contextlib
import errno
import itertools
import json
import signal
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from aiohttp import WSMsgType, web

from rtctl.config.errors import UserError
from rtctl.machines.base import DESCRIBED
from rtctl.scope.connection import Connection
from rtctl.scope.feed import Feed
from rtctl.scope.guard import HEADERS, Guard
from rtctl.scope.spectra import Spectra
from rtctl.scope.tunable import PARTS, tunable

ADDRESS = "127.0.0.1"
STATIC = Path(__file__).parent / "static"
FRAMES = 30.0  # frames a second
LOOK = 0.25  # s between two requests of the status
SETTINGS_EVERY = 4  # status requests between two requests of the settings
MOST_VIEWERS = 8
STARTING = "is there but does not answer yet: it compiles its tick, or hangs; waiting for it"
ABSENT = "does not run yet; waiting for it, start it with `rtctl run`"


class Scope:
    """Server of the page for the machine of `feed`. Without `control` the page cannot command the machine."""

    def __init__(self, feed: Feed, guard: Guard, control: bool = False):
        self.feed, self.guard, self.control = feed, guard, control
        self.connections: set[Connection] = set()
        self.spectra = Spectra()
        self._settings: list[dict[str, Any]] = []
        self._told: tuple[Any, ...] = ()
        self._run = 0

    @property
    def url(self) -> str:
        return f"http://{ADDRESS}:{self.guard.port}/?token={self.guard.token}"

    async def serve(
        self, port: int, ready: Callable[["Scope"], None] = lambda _: None, say: Callable[[str], None] = lambda _: None
    ) -> None:
        """Serve on loopback until cancelled, SIGINT or SIGTERM. Raises UserError where the port is not available.

        `ready` is called once pages are served; `say` gets messages while no daemon has answered.
        """
        app = web.Application(middlewares=[self._guarded], client_max_size=1024)
        app.add_routes([web.get("/", self._page), web.get("/stream", self._stream), web.static("/static", STATIC)])
        runner = web.AppRunner(app, access_log=None, handle_signals=False, shutdown_timeout=1.0)
        await runner.setup()
        try:
            site = web.TCPSite(runner, ADDRESS, port, reuse_address=True)
            try:
                await site.start()
            except (OSError, OverflowError) as error:
                taken = getattr(error, "errno", None) == errno.EADDRINUSE
                why = "is in use; choose another, or 0 for any" if taken else str(error)
                raise UserError(f"--port {port}: {why}") from None
            self.guard.port = runner.addresses[0][1]
            ready(self)  # at once: a daemon that starts may take a minute to answer
            await self.feed.look()
            ended = asyncio.Event()
            for number in (signal.SIGINT, signal.SIGTERM):
                with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):  # not in the main thread
                    asyncio.get_running_loop().add_signal_handler(number, ended.set)
            await first_of(self._frames(), self._looks(), self._first_answer(say), ended.wait())
        finally:
            for connection in list(self.connections):
                await connection.end("the scope's server ends")
            await runner.cleanup()

    # what is sent

    async def _frames(self) -> None:
        """Thirty times a second, store new rows and send a frame to each viewer that can take one."""
        clock = asyncio.get_running_loop()
        due = clock.time()
        for turn in itertools.count():
            self.feed.drain()
            if self.feed.run != self._run:
                self._run = self.feed.run
                for connection in self.connections:
                    self._start(connection)
            for connection in self.connections:
                connection.send_frame(turn)
            due = max(due + 1.0 / FRAMES, clock.time())
            await asyncio.sleep(due - clock.time())

    async def _looks(self) -> None:
        """Four times a second, send the status; once a second, ask for changed settings."""
        turn = 0
        while True:
            await self.feed.look()
            if self.feed.alive and turn % SETTINGS_EVERY == 0:
                await self._look_at_settings()
            turn += 1
            told = (self.feed.alive, self.feed.there, self.feed.run, json.dumps(self._settings), len(self.feed.signals))
            for connection in self.connections:
                if told != self._told:
                    connection.send_text(self._hello())
                connection.send_text(self._status(connection))
            self._told = told
            await asyncio.sleep(LOOK)

    async def _first_answer(self, say: Callable[[str], None]) -> None:
        """Report a missing or starting daemon until it answers, and then its answer."""
        told = ""
        while not self.feed.alive:
            lack = STARTING if self.feed.there else ABSENT
            if lack != told:
                say(f"{self.feed.name} {lack}")
                told = lack
            await asyncio.sleep(LOOK)
        if told:
            say(f"{self.feed.name} answers")
        await asyncio.Event().wait()

    async def _look_at_settings(self) -> None:
        with contextlib.suppress(UserError):
            values = {part: (await self.feed.call("get", path=part))["value"] for part in PARTS}
            machine = self.feed.status["machine"]
            if machine == DESCRIBED:
                machine = (await self.feed.call("get", path="machine"))["value"]
            self._settings = tunable(machine, values)

    def _start(self, connection: Connection) -> None:
        if self.feed.history is not None:
            connection.viewer.start(self.feed.history, self.feed.rate)

    def _hello(self) -> dict[str, Any]:
        return {
            "kind": "hello",
            "name": self.feed.name,
            "control": self.control,
            "alive": self.feed.alive,
            "run": self.feed.run,
            "signals": self.feed.signals,
            "settings": self._settings,
            "rate": self.feed.rate,
            "history": self.feed.history.capacity / self.feed.rate if self.feed.history and self.feed.rate else 0.0,
        }

    def _status(self, connection: Connection) -> dict[str, Any]:
        history = self.feed.history
        return {
            "kind": "status",
            "alive": self.feed.alive,
            "there": self.feed.there,
            "status": self.feed.status,
            "lateness": self.feed.lateness.tolist(),
            "dropped": connection.viewer.dropped,
            "lost": history.lost if history is not None else 0,
            "viewers": len(self.connections),
        }

    # what comes in

    @web.middleware
    async def _guarded(self, request: web.Request, handler: Any) -> web.StreamResponse:
        response = self.guard.refuse(request)
        if response is None:
            try:
                response = await handler(request)
            except web.HTTPException as error:
                error.headers.update(HEADERS)
                raise
        if not response.prepared:
            response.headers.update(HEADERS)
        return response

    async def _page(self, request: web.Request) -> web.StreamResponse:
        response = web.FileResponse(STATIC / "index.html")
        self.guard.welcome(response)
        return response

    async def _stream(self, request: web.Request) -> web.StreamResponse:
        if len(self.connections) >= MOST_VIEWERS:
            return web.Response(status=503, text=f"this scope serves at most {MOST_VIEWERS} pages; close another one\n")
        socket = web.WebSocketResponse(heartbeat=20.0, max_msg_size=64 * 1024, compress=False)
        await socket.prepare(request)
        connection = Connection(socket, self)
        self.connections.add(connection)
        self._start(connection)
        connection.send_text(self._hello())
        connection.send_text(self._status(connection))
        try:
            async for message in socket:
                if message.type is not WSMsgType.TEXT:
                    break
                await connection.hear(message.data)
        finally:
            self.connections.discard(connection)
        return socket


async def first_of(*works: Coroutine[Any, Any, Any]) -> None:
    """Run all coroutines until the first one ends, then cancel the others. Raises the exception of the first one."""
    tasks = [asyncio.create_task(work) for work in works]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
