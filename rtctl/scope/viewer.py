"""Frames of one viewer, from its view and the history. Independent of sockets.

A frame is made when it can be sent, from all rows since the last one. So a slow viewer gets fewer and larger frames,
and no row is left out.
"""

import json
import math
from typing import Any, NamedTuple

import numpy as np

from rtctl.scope.history import History
from rtctl.scope.reduce import envelope, spectrum, thinned
from rtctl.scope.spectra import Spectra
from rtctl.scope.trigger import PATIENCE, Trigger
from rtctl.scope.view import View

OUTSTANDING = 2  # most frames sent and not yet drawn
SLOW = {"time": 1, "xy": 2, "spectrum": 6}  # kind of view -> n; it is drawn in every n-th frame


class Picture(NamedTuple):
    """Rows that stay on the screen, with all signals: a sweep or a held picture."""

    names: tuple[str, ...]
    values: np.ndarray  # (names, rows)
    zero: float  # t at zero of the axis, s
    sweep: bool
    last: int  # number of the last row, plus 1


class Viewer:
    """Maker of a viewer's frames: `frame()` returns the next one, `drawn()` reports that one was drawn.

    `dropped` counts frames that were due before earlier ones were drawn. Viewers of one history may share `spectra`.
    """

    def __init__(self, spectra: Spectra | None = None) -> None:
        self.view = View()
        self.dropped = 0
        self.outstanding = 0
        self._spectra = spectra or Spectra()
        self._history: History | None = None
        self._rate = 1.0
        self._trigger: Trigger | None = None
        self._sweep: Picture | None = None  # newest sweep
        self._held: Picture | None = None
        self._fresh = False  # the sweep or held picture must be sent for the current view
        self._sent = 0  # rows before this one are in earlier frames
        self._restart = True
        self._turn = 0
        self._asked = False

    def start(self, history: History, rate: float) -> None:
        """Begin a new run with a new history; a held picture stays on the screen."""
        self._history, self._rate = history, rate
        self._sweep = None
        self._begin()

    def look(self, view: View) -> None:
        """Show `view` from now on."""
        old, self.view, self._asked = self.view, view, True
        released = old.hold and not view.hold and not (self._trigger is not None and self._trigger.done)
        if (view.trigger, view.window) != (old.trigger, old.window):
            self._sweep = None
            self._begin()
        elif released:
            self._begin()
        self._restart = self._fresh = True
        if view.hold and not old.hold:
            self._hold()
        elif not view.hold:
            self._held = None

    def drawn(self) -> None:
        self.outstanding = max(0, self.outstanding - 1)

    def frame(self, turn: int | None = None) -> bytes | None:
        """The frame that is due; None where there is nothing new, or the viewer has not drawn the last ones.

        `turn` counts frames for all viewers, so that viewers of one spectrum get it in one frame.
        """
        if self._history is None or not self._asked:
            return None
        self._turn = self._turn + 1 if turn is None else turn
        self._look_for_sweep()
        if self.outstanding >= OUTSTANDING:
            self.dropped += 1
            return None
        made = self._make()
        self.outstanding += made is not None
        return made

    @property
    def rows(self) -> int:
        """Number of rows of the window, limited by the history."""
        assert self._history is not None
        return int(min(max(round(self.view.window * self._rate), 8), 0.9 * self._history.capacity))

    @property
    def bucket(self) -> int:
        """Number of rows in a column."""
        return max(1, math.ceil(self.rows / self.view.columns))

    def _begin(self) -> None:
        """Restart the frames from the start of the window, and the trigger's search from the newest row."""
        self._restart = True
        t, history = self.view.trigger, self._history
        if history is None:
            return
        before = round(t.pre * self.rows)
        on = t.mode != "off" and t.signal in history.index
        self._trigger = Trigger(t.level, t.edge, self.rows, before, t.mode == "single", history.head) if on else None

    def _look_for_sweep(self) -> None:
        trigger, history = self._trigger, self._history
        if trigger is None or history is None or self._held is not None:
            return
        found = trigger.feed(history, self.view.trigger.signal)
        if found is not None:
            self._sweep, self._fresh = self._copy(found.first, found.last, found.at), True

    def _copy(self, first: int, last: int, zero: int = -1) -> Picture:
        """Picture of rows `first` to `last`; `zero` is the row at zero of the axis, -1 for the controller's clock."""
        assert self._history is not None
        names = self._history.names
        at = float(self._history.take(("t",), zero, zero + 1)[0, 0]) if zero >= 0 else 0.0
        return Picture(names, self._history.take(names, first, last), at, zero >= 0, last)

    def _hold(self) -> None:
        history = self._history
        if history is None:
            return
        if self._rolls():
            self._held = self._copy(history.head - self.rows, history.head)
        else:
            self._held = self._sweep or self._copy(history.head, history.head)

    def _rolls(self) -> bool:
        """Whether the view shows the newest rows and not a sweep."""
        assert self._history is not None
        if self.view.trigger.mode == "off":
            return True
        if self.view.trigger.mode != "auto":
            return False
        patience = 1.5 * self.rows + PATIENCE * self._rate
        return self._sweep is None or self._history.head - self._sweep.last > patience

    def _make(self) -> bytes | None:
        if self._held is not None or not self._rolls():
            still = self._held or self._sweep
            if still is None or not self._fresh:
                return None
            self._fresh, self._restart = False, True
            return self._picture(still)
        if self.view.kind == "time":
            return self._roll()
        if self._turn % SLOW[self.view.kind]:
            return None
        assert self._history is not None
        if self.view.kind == "spectrum":
            return self._newest_spectrum()
        names, head = ("t", *self._wanted(self._history.names)), self._history.head
        return self._picture(Picture(names, self._history.take(names, head - self.rows, head), 0.0, False, head))

    def _wanted(self, there: tuple[str, ...]) -> list[str]:
        """Names of the view's signals, as far as they are in `there`."""
        names = [self.view.x, *self.view.signals] if self.view.kind == "xy" else self.view.signals
        return [name for name in names if name in there]

    def _roll(self) -> bytes | None:
        """Frame with the columns that are complete since the last frame."""
        history, size = self._history, self.bucket
        assert history is not None
        oldest = -(-max(history.first, history.head - self.rows) // size) * size
        restart = self._restart or self._sent < oldest or self._sent % size != 0
        first, last = oldest if restart else self._sent, history.head // size * size
        if last <= first:
            return None
        self._sent, self._restart = last, False
        names = self._wanted(history.names)
        values = history.take(("t", *names), first, last)
        return self._time(names, values, size, {"kind": "roll", "restart": restart, "window": self.rows / self._rate})

    def _picture(self, still: Picture) -> bytes:
        """Frame with the whole of a sweep, a held picture or the window."""
        names = self._wanted(still.names)
        values = still.values[[still.names.index(name) for name in ("t", *names)]]
        values[0] -= still.zero
        held = self._held is not None
        if held and self.view.span is not None:
            first = int(np.searchsorted(values[0], self.view.span[0])) - 1  # one row beyond each end: lines continue
            last = int(np.searchsorted(values[0], self.view.span[1], "right")) + 1
            values = values[:, max(first, 0) : last]
        about = self._about(names, still.sweep)
        if self.view.kind == "xy":
            points, step = thinned(values[1:])
            return pack({**about, "kind": "xy", "step": step}, points)
        if self.view.kind == "spectrum":
            f, level = spectrum(values[1:], 1.0 / self._rate, self.view.columns)
            return pack({**about, "kind": "spectrum", "rows": values.shape[1]}, [f, *level])
        size = max(1, math.ceil(values.shape[1] / self.view.columns))
        return self._time(names, values, size, {**about, "kind": "picture"})

    def _newest_spectrum(self) -> bytes:
        """Frame with the spectrum of the window's rows, shared with other viewers."""
        history = self._history
        assert history is not None
        names = self._wanted(history.names)
        f, level, rows = self._spectra.newest(history, names, self.rows, 1.0 / self._rate, self.view.columns)
        return pack({**self._about(names, sweep=False), "kind": "spectrum", "rows": rows}, [f, *level])

    def _about(self, names: list[str], sweep: bool) -> dict[str, Any]:
        """Metadata of a picture frame."""
        about = {"names": names, "sweep": sweep, "held": self._held is not None, "span": self.view.span}
        if self._trigger is not None:
            about |= {"sweeps": self._trigger.count, "done": self._trigger.done}
        return about

    def _time(self, names: list[str], values: np.ndarray, size: int, about: dict[str, Any]) -> bytes:
        low, high = envelope(values[1:], size)
        arrays = [values[0, ::size], *low, *(high if size > 1 else ())]
        return pack({**about, "names": names, "bucket": size}, arrays)


def pack(about: dict[str, Any], arrays: Any) -> bytes:
    """Bytes of a frame: length of a JSON text, the text, and arrays of float64 of equal length."""
    text = json.dumps({**about, "arrays": len(arrays)}).encode()
    text += b" " * (-(4 + len(text)) % 8)  # to align the numbers to 8 bytes
    body = b"".join(np.ascontiguousarray(a, "<f8").tobytes() for a in arrays)
    return len(text).to_bytes(4, "little") + text + body
