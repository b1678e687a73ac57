"""Process at the door of a daemon: takes the connections of a listening socket, so many at a time, and passes on bytes.

libzmq takes as many connections as there are, and aborts where the process has no file descriptors left. So nobody is
connected to the daemon itself: each connection has its twin to a socket of the daemon that only this user can reach.
A flood of connections fills the places here and nothing else. It knows no messages; keys and refusals are the daemon's.

Nothing of numpy or ZeroMQ is imported here, so that it is there at the first connection, in some 30 ms.

Usage: python -m rtctl.daemon.door_process '[{"fd": 7, "inner": "/run/...", "places": 64, "replaces": true}]'. It ends
when its standard input does, after what is under way, and one second at most.
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

PIECE = 1 << 16  # bytes that are read at once, and that may wait for a slow reader
AT_ONCE = 16  # connections that are taken before those that are there have their turn again
LAST = 1.0  # s for what is under way when the daemon ends
ANSWER = 5.0  # s in which nobody takes the place of who has said something: an answer to it may be under way


class Pair:
    """A connection and its twin. `keeps` is the time until which its place is its own."""

    def __init__(self, door: "Door", outer: socket.socket, inner: socket.socket):
        self.door, self.keeps, self.ends = door, time.monotonic(), False
        self.other = {outer: inner, inner: outer}
        self.outer = outer
        self.waiting = {outer: bytearray(), inner: bytearray()}  # what goes out there

    def move(self, source: socket.socket) -> None:
        """Pass on what came from `source`. Raises OSError where it is gone."""
        try:
            data = source.recv(PIECE)
        except BlockingIOError:
            return
        if not data:
            self.ends = True  # what waits for the other side still goes there
        if source is self.outer:
            self.keeps = time.monotonic() + ANSWER
        self.waiting[self.other[source]] += data

    def flush(self, target: socket.socket) -> None:
        """Send what waits for `target`, as far as it takes it. Raises OSError where it is gone."""
        waiting = self.waiting[target]
        with contextlib.suppress(BlockingIOError):
            del waiting[: target.send(waiting)]

    def events(self, end: socket.socket) -> int:
        """What is wanted of one end: to read while the other side keeps up, to write what waits."""
        wanted = selectors.EVENT_WRITE if self.waiting[end] else 0
        if not self.ends and len(self.waiting[self.other[end]]) < PIECE:
            wanted |= selectors.EVENT_READ
        return wanted

    @property
    def done(self) -> bool:
        return self.ends and not any(self.waiting.values())


class Door:
    """A listening socket with `places`. Where all are taken, a new connection has the place of the one that has been
    silent for longest if the door `replaces`, and none otherwise. Who never said anything counts as ANSWER more silent,
    so that a crowd of such connections takes no place from which a question was just asked."""

    def __init__(self, fd: int, inner: str, places: int, replaces: bool):
        self.listener = socket.socket(fileno=fd)
        self.listener.setblocking(False)
        self.inner, self.places, self.replaces = inner, places, replaces
        self.pairs: list[Pair] = []

    def take(self, opened: Callable[[Pair], None], closed: Callable[[Pair], None]) -> None:
        """Take the connections that wait."""
        for _ in range(AT_ONCE):
            try:
                outer, _ = self.listener.accept()
            except OSError:  # none waits, or one that waited is gone
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
        except OSError:  # the daemon is ending, or has too many in its queue: who is in earnest comes again
            outer.close()
            inner.close()
            return None
        return Pair(self, outer, inner)


class Hall:
    """All doors of a process, and the connections in them."""

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
        """Serve what is ready. Returns False when standard input has ended."""
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
        """Let nobody in any more, and bring what is under way to its end."""
        for door in self.doors:
            self.selector.unregister(door.listener)
            door.listener.close()
        deadline = time.monotonic() + LAST
        while any(door.pairs for door in self.doors) and (left := deadline - time.monotonic()) > 0:
            self.turn(left)

    def _serve(self, pair: Pair, end: socket.socket, events: int) -> None:
        if pair not in pair.door.pairs:  # closed in this very turn
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
