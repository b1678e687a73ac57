"""Proxy process of a daemon ("door"): accepts a limited number of connections and forwards their bytes.

libzmq accepts every connection, and aborts when the process has no file descriptors left. So clients do not connect to
the daemon itself. The proxy opens a second connection for each client, to a socket that only this user can reach. A
flood of connections fills the places of the proxy only. The proxy does not read messages; the daemon checks keys.

This module imports neither numpy nor ZeroMQ, so the process serves its first connection after some 30 ms.

Usage: python -m rtctl.daemon.door_process '[{"fd": 7, "inner": "/run/...", "places": 64, "replaces": true}]'. The
process ends when its standard input ends, after pending bytes, within one second.
"""

import contextlib
import json
import selectors
import signal
import socket
import sys
import time
from collections.abc import Callable
from typing import cast

PIECE = 1 << 16  # bytes in one read, and bytes that may wait for a slow reader
AT_ONCE = 16  # connections accepted before open connections are served again
LAST = 1.0  # s to forward pending bytes when the daemon ends
ANSWER = 5.0  # s by which a connection that has sent ranks before one that has not: its answer may be pending


class Pair:
    """A client's connection and its connection to the daemon. A new client replaces the pair of lowest `keeps`."""

    def __init__(self, door: "Door", outer: socket.socket, inner: socket.socket):
        self.door, self.keeps, self.ends = door, time.monotonic(), False
        self.other = {outer: inner, inner: outer}
        self.outer = outer
        self.waiting = {outer: bytearray(), inner: bytearray()}  # bytes to send, by socket

    def move(self, source: socket.socket) -> None:
        """Read bytes from `source` for the other socket. Raises OSError where `source` is closed."""
        try:
            data = source.recv(PIECE)
        except BlockingIOError:
            return
        if not data:
            self.ends = True  # bytes that wait for the other side are still sent
        if source is self.outer:
            self.keeps = time.monotonic() + ANSWER
        self.waiting[self.other[source]] += data

    def flush(self, target: socket.socket) -> None:
        """Send waiting bytes to `target`, as many as it accepts. Raises OSError where `target` is closed."""
        waiting = self.waiting[target]
        with contextlib.suppress(BlockingIOError):
            del waiting[: target.send(waiting)]

    def events(self, end: socket.socket) -> int:
        """Selector events for one end: read while the other side keeps up, write while bytes wait."""
        wanted = selectors.EVENT_WRITE if self.waiting[end] else 0
        if not self.ends and len(self.waiting[self.other[end]]) < PIECE:
            wanted |= selectors.EVENT_READ
        return wanted

    @property
    def done(self) -> bool:
        return self.ends and not any(self.waiting.values())


class Door:
    """A listening socket with `places` for connections.

    With all places taken, a new connection is refused, or replaces the one that has been silent for longest (with
    `replaces`). A connection that has never sent counts as silent for ANSWER s more. So a crowd of silent connections
    does not replace a client that waits for an answer.
    """

    def __init__(self, fd: int, inner: str, places: int, replaces: bool):
        self.listener = socket.socket(fileno=fd)
        self.listener.setblocking(False)
        self.inner, self.places, self.replaces = inner, places, replaces
        self.pairs: list[Pair] = []

    def take(self, opened: Callable[[Pair], None], closed: Callable[[Pair], None]) -> None:
        """Accept waiting connections, at most AT_ONCE."""
        for _ in range(AT_ONCE):
            try:
                outer, _ = self.listener.accept()
            except OSError:  # none waits, or the client has left
                return
            if len(self.pairs) >= self.places:
                if not self.replaces:
                    outer.close()
                    continue
                closed(min(self.pairs, key=lambda pair: pair.keeps))
            pair = self._connected(outer)
            if pair is not None:
                self.pairs.append(pair)
                opened(pair)

    def _connected(self, outer: socket.socket) -> Pair | None:
        inner = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            outer.setblocking(False)
            if outer.family != socket.AF_UNIX:
                outer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            inner.setblocking(False)
            inner.connect(self.inner)
        except OSError:  # the daemon is ending, or its queue is full: the client may try again
            outer.close()
            inner.close()
            return None
        return Pair(self, outer, inner)


class Hall:
    """Event loop of a proxy process: all its doors and their connections."""

    def __init__(self, doors: list[Door]):
        self.selector = selectors.DefaultSelector()
        self.doors = doors
        for door in doors:
            self.selector.register(door.listener, selectors.EVENT_READ, door)

    def open(self, pair: Pair) -> None:
        for end in pair.other:
            self.selector.register(end, selectors.EVENT_READ, pair)

    def close(self, pair: Pair) -> None:
        """Close both ends."""
        if pair in pair.door.pairs:
            pair.door.pairs.remove(pair)
            for end in pair.other:
                with contextlib.suppress(KeyError):
                    self.selector.unregister(end)
                end.close()

    def turn(self, timeout: float | None) -> bool:
        """Serve sockets that are ready within `timeout` s. Returns False when standard input has ended."""
        goes_on = True
        for key, events in self.selector.select(timeout):
            if key.data is None:
                goes_on = False
            elif isinstance(key.data, Door):
                key.data.take(self.open, self.close)
            else:
                self._serve(key.data, cast(socket.socket, key.fileobj), events)
        return goes_on

    def last(self) -> None:
        """Close the listening sockets, and forward pending bytes for at most LAST s."""
        for door in self.doors:
            self.selector.unregister(door.listener)
            door.listener.close()
        deadline = time.monotonic() + LAST
        while any(door.pairs for door in self.doors) and (left := deadline - time.monotonic()) > 0:
            self.turn(left)

    def _serve(self, pair: Pair, end: socket.socket, events: int) -> None:
        if pair not in pair.door.pairs:  # closed earlier in this turn
            return
        try:
            if events & selectors.EVENT_READ:
                pair.move(end)
                pair.flush(pair.other[end])
            if events & selectors.EVENT_WRITE:
                pair.flush(end)
        except OSError:
            pair.ends = True
            pair.waiting = {end: bytearray() for end in pair.other}
        if pair.done:
            self.close(pair)
            return
        for each in pair.other:
            self._want(each, pair, pair.events(each))

    def _want(self, end: socket.socket, pair: Pair, events: int) -> None:
        there = self.selector.get_map().get(end)
        if not events:
            if there is not None:
                self.selector.unregister(end)
        elif there is None:
            self.selector.register(end, events, pair)
        elif there.events != events:
            self.selector.modify(end, events, pair)


def main(orders: str) -> None:
    for meant_for_the_daemon in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
        signal.signal(meant_for_the_daemon, signal.SIG_IGN)
    hall = Hall([Door(**order) for order in json.loads(orders)])
    hall.selector.register(sys.stdin, selectors.EVENT_READ, None)
    while hall.turn(None):
        pass
    hall.selector.unregister(sys.stdin)
    hall.last()


if __name__ == "__main__":
    main(sys.argv[1])
