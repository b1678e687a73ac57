"""A device at the far end of a pseudo-terminal; runs the C code of examples/serial_board/."""

import contextlib
import ctypes
import os
import select
import shutil
import subprocess
import threading
import time
import tty
from pathlib import Path

import pytest

HEADER = Path(__file__).parents[2] / "examples" / "serial_board" / "rtctl_board.h"
GLUE = """
#include "rtctl_board.h"
int byte_in(rtctl_board *b, uint8_t byte, uint32_t now) { return rtctl_byte(b, byte, now); }
void begin(rtctl_board *b, int o, int i, int c, int l, const char *name) {
  rtctl_begin(b, (uint8_t)o, (uint8_t)i, (uint8_t)c, (uint8_t)l, name);
}
void watch(rtctl_board *b, uint32_t now) { rtctl_watch(b, now); }
unsigned size(void) { return sizeof(rtctl_board); }
"""


class Board(ctypes.Structure):
    """Public fields of the C struct rtctl_board."""

    _fields_ = [
        ("output", ctypes.c_float * 16), ("on", ctypes.c_uint8), ("lines_out", ctypes.c_uint8),
        ("counter", ctypes.c_uint32 * 16), ("input", ctypes.c_float * 16), ("lines_in", ctypes.c_uint8),
        ("fault", ctypes.c_uint8), ("reply", ctypes.c_uint8 * 260), ("reply_length", ctypes.c_uint16),
        ("rest", ctypes.c_uint8 * 400),
    ]  # fmt: skip


def library(folder: Path):
    """The C code of the example as a library; warnings are errors."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler (cc) here")
    source, out = folder / "glue.c", folder / "device.so"
    source.write_text(GLUE)
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-O1", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, f"-I{HEADER.parent}", source, "-o", out], check=True)
    return ctypes.CDLL(str(out))


class Device:
    """`port` is the device file; `board` holds outputs and counters for an emulated motor and encoder."""

    def __init__(self, lib, outputs=1, inputs=0, counters=1, lines=0, name=b"device") -> None:
        assert ctypes.sizeof(Board) >= lib.size()
        self.lib, self.board, self.lock = lib, Board(), threading.RLock()
        lib.begin(ctypes.byref(self.board), outputs, inputs, counters, lines, name)
        self.master, self.slave = os.openpty()
        tty.setraw(self.master)
        tty.setraw(self.slave)
        self.port = os.ttyname(self.slave)
        os.set_blocking(self.master, False)
        self.silent, self.delay, self.spoil, self.running = False, 0.0, None, True
        self.later: list[tuple[float, bytes]] = []
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    @staticmethod
    def now() -> int:
        return int(time.monotonic() * 1e3) & 0xFFFFFFFF

    def _run(self) -> None:
        while self.running:
            select.select([self.master], [], [], 0.0005)
            self.pump()
            with self.lock:
                self.lib.watch(ctypes.byref(self.board), ctypes.c_uint32(self.now()))
                for due in [each for each in self.later if each[0] <= time.monotonic()]:
                    self.later.remove(due)
                    self._put(due[1])
                self.move(time.monotonic())

    def move(self, now: float) -> None:
        """No motion by default; overridden by tests."""

    def pump(self) -> None:
        with self.lock:
            try:
                data = os.read(self.master, 4096)
            except OSError:
                return
            for byte in data:
                if self.lib.byte_in(ctypes.byref(self.board), byte, ctypes.c_uint32(self.now())) and not self.silent:
                    reply = bytes(self.board.reply[: self.board.reply_length])
                    reply = self.spoil(reply) if self.spoil else reply
                    if self.delay:
                        self.later.append((time.monotonic() + self.delay, reply))
                    else:
                        self._put(reply)

    def _put(self, reply: bytes) -> None:
        with contextlib.suppress(OSError):
            os.write(self.master, reply)

    def told(self, number: int) -> Board:
        """Received outputs, after the device has read the outputs of this number."""
        end = time.monotonic() + 5
        while self.running and self.board.reply[3] != number and time.monotonic() < end:
            self.pump()
        return self.board

    def unplug(self) -> None:
        """Pull it out."""
        self.close()

    def close(self) -> None:
        if self.running:
            self.running = False
            self.thread.join()
            os.close(self.slave)
            os.close(self.master)
