"""Connection to one browser: its requests, and frames and texts to it, sent without waiting."""

import asyncio
import contextlib
import json
import math
from typing import TYPE_CHECKING, Any

from aiohttp import web

from rtctl.config.errors import UserError
from rtctl.daemon.log import log
from rtctl.scope.view import MOST_BYTES, read_view
from rtctl.scope.viewer import Viewer

if TYPE_CHECKING:
    from rtctl.scope.server import Scope

COMMANDS = ("arm", "disarm", "reset", "play", "setpoint", "set")  # commands to the daemon that the page may send
MOST_WAITING = 100  # unsent messages, above which the connection is closed


class Connection:
    """A WebSocket with its viewer. Messages of the page are JSON texts with a key `op`:

    view     {"op": "view", "view": {...}}    the view to show, see View
    drawn    {"op": "drawn"}                  a frame is on the screen: the page can take another
    others   {"op": "set", "id": 3, "args": {...}}, answered by {"kind": "reply", "id": 3, "ok": ..., ...}
    """

    def __init__(self, socket: web.WebSocketResponse, scope: "Scope"):
        self.viewer = Viewer(scope.spectra)
        self._socket, self._scope = socket, scope
        self._sending: set[asyncio.Task[None]] = set()

    def send_frame(self, turn: int) -> None:
        """Send the frame that is due, if the browser has drawn the earlier ones."""
        try:
            frame = self.viewer.frame(turn)
        except Exception as error:  # an error of one viewer must not stop the others
            log.exception("no frame", error=str(error))
            self._send(self._socket.close(code=1011))
            return
        if frame is not None:
            self._send(self._socket.send_bytes(frame))

    def send_text(self, message: dict[str, Any]) -> None:
        if len(self._sending) > MOST_WAITING:
            self._send(self._socket.close())
        elif not self._socket.closed:
            self._send(self._socket.send_str(json.dumps(finite(message))))

    async def hear(self, text: str) -> None:
        """Carry out a message of the page. A message with an error is answered with the error and has no effect."""
        id = None
        try:
            message = read(text)
            id, op = message.get("id"), message.get("op")
            if op == "drawn":
                self.viewer.drawn()
            elif op == "view":
                feed = self._scope.feed
                names = feed.history.names if feed.history is not None else ()
                self.viewer.look(read_view(message.get("view"), names))
            else:
                result = await self._command(op, message.get("args", {}))
                self.send_text({"kind": "reply", "id": id, "ok": True, "result": result})
        except UserError as error:
            self.send_text({"kind": "reply", "id": id, "ok": False, "error": str(error)})

    async def end(self, why: str) -> None:
        await self._socket.close(code=1001, message=why.encode())

    async def _command(self, op: Any, args: Any) -> dict[str, Any]:
        if op not in COMMANDS:
            raise UserError(f"the page may not ask for '{str(op)[:40]}'; it may ask for {', '.join(COMMANDS)}")
        if not self._scope.control:
            raise UserError("this scope is read-only; start it with `rtctl scope --control` to command the machine")
        if not isinstance(args, dict) or not all(isinstance(key, str) and key.isidentifier() for key in args):
            raise UserError(f"'{op}': args must be a map of names and values")
        if "op" in args or "self" in args:
            raise UserError(f"'{op}' takes no argument 'op' or 'self'")
        return await self._scope.feed.call(op, **args)

    def _send(self, work: Any) -> None:
        task = asyncio.create_task(_unless_gone(work))
        self._sending.add(task)
        task.add_done_callback(self._sending.discard)


async def _unless_gone(work: Any) -> None:
    with contextlib.suppress(ConnectionError, RuntimeError):  # the browser has left; the reading end notices too
        await work


def read(text: str) -> dict[str, Any]:
    """Message of the page as a dict. Raises UserError where the text is too long or no JSON object."""
    if len(text) > MOST_BYTES:
        raise UserError(f"a message of {len(text)} characters; at most {MOST_BYTES} are taken")
    try:
        message = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise UserError("not a JSON text") from None
    if not isinstance(message, dict):
        raise UserError("not a JSON object")
    return message


def finite(value: Any) -> Any:
    """Copy of `value` with None for NaN and infinity, which JSON cannot hold."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _no_constant(text: str) -> None:
    raise ValueError(f"{text} is not finite")
