"""Board of a microcontroller on a serial or USB line: outputs, inputs, counters and lines in a small frame.

Each turn sends one frame of outputs and receives one sample. The device sets its outputs to zero by itself if it gets
no frame for `timeout`. The run ends with the outputs at zero if the device does not answer for `timeout`, reports a
fault, or its line fails.

Source: serial_frame.py for the frame; examples/serial_board/ for the other end in C; termios(3).
Never run on a device: see docs/hardware.md.
"""

import contextlib
import errno
import os
import termios
import time
import tty
from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import Field

from rtctl.config.errors import UserError
from rtctl.drivers import daq_stc
from rtctl.drivers import serial_frame as frame
from rtctl.drivers.board import LINES, BoardError, Wiring
from rtctl.drivers.bus import BusBoard
from rtctl.idiom import Settings, quantity

HELLO = 3.0  # s to wait for the answer to a hello: a board with a bootloader restarts when its port is opened
AGAIN = 0.2  # s between two hellos
SECOND = 1_000_000_000
BAUDS = tuple(
    int(name[1:]) for name in dir(termios) if name[:1] == "B" and name[1:].isdigit() and int(name[1:]) >= 9600
)


class SerialSettings(Settings):
    """Settings of a microcontroller on a serial or USB line."""

    kind: Literal["serial"] = "serial"
    port: str = Field("/dev/ttyACM0", description="device file of the line")
    baud: int = Field(1_000_000, description="bits a second; a USB device takes any")
    timeout: float = quantity(
        0.05, unit="s", ge=0.002, le=10, help="oldest answer that is acted on; the device's own time-out too"
    )
    rate: float | None = quantity(None, unit="Hz", gt=0, le=10e3, help="turns a second; as the loop's if absent")

    @property
    def place(self) -> str:
        """Device file, for messages."""
        return self.port


class SerialBoard(BusBoard):
    """Board of a device at a port. `fd` is an open line, for tests."""

    REASONS = {  # noqa: RUF012
        **dict.fromkeys((errno.EIO, errno.EPIPE, errno.ENXIO), "the port is gone; was the device pulled out?"),
        errno.EAGAIN: "the send buffer is full; does the device read?",
    }

    def __init__(self, settings: SerialSettings, wiring: Wiring, rate: float, fd: int | None = None) -> None:
        super().__init__(wiring)
        self.settings = settings
        check(wiring)
        self._given, self._fd = fd, -1
        self._patience = round(0.5 * SECOND / rate)
        self._line = np.zeros(1, frame.LINE)[0]
        self._device = ""
        self._on, self._levels = 0, 0
        self._start: list[int] = []
        self.unread = False  # whether the answer to the newest outputs has yet to be read

    @property
    def name(self) -> str:
        return self.settings.port + (f" ({self._device})" if self._device else "")

    # Methods of Board

    def _open(self) -> None:
        self._fd = self._given if self._given is not None else connect(self.settings)
        _compile()
        line, w = self._line, self.wiring
        line["fd"], line["at"], line["hello"], line["garbled"] = self._fd, 0, 0, 0
        line["writes"], line["reads"], line["counters"] = len(w.outputs), len(w.inputs), w.counters
        line["outputs"] = 0.0
        self._on = self._levels = 0
        self._hello()
        line["number"], line["answered"], line["sent_at"] = 0, -1, 0
        line["answered_at"] = line["heard_at"] = time.monotonic_ns()
        self.zero()
        while line["answered"] != line["number"]:  # the current position becomes the zero of the counters
            self._received(frame.sample(line, self._patience))
            self._look()
        self._start = [int(n) for n in line["counts"][: w.counters]]
        self.unread = False

    def _hello(self) -> None:
        line = self._line
        begun, said = time.monotonic(), -1e9
        while not line["hello"]:
            now = time.monotonic()
            if now - begun > HELLO:
                what = "does not answer" if not line["garbled"] else "sends bytes that are no rtctl frame"
                raise UserError(f"driver.port: {self.settings.port} {what} within {HELLO:g} s; does the device run the "
                                f"firmware of docs/hardware.md, at {self.settings.baud} baud?")  # fmt: skip
            if now - said > AGAIN:
                said = now
                self._sent(frame.say_hello(line, round(self.settings.timeout * 1e3)), "hello")
            self._received(frame.drain(line))
            time.sleep(1e-3)
        told = bytes(line["told"][: int(line["told_length"])])
        if len(told) < 5 or told[0] != frame.VERSION:
            version = told[0] if told else "none"
            raise UserError(
                f"driver.port: the device speaks version {version} of the frame, not {frame.VERSION}; load the "
                "firmware of this version of rtctl"
            )
        self._device = told[5:].decode(errors="replace").strip("\0 ")
        self._fits(*told[1:5])

    def _fits(self, outputs: int, inputs: int, counters: int, lines: int) -> None:
        w = self.wiring
        for what, there, needed in (("outputs", outputs, len(w.outputs)), ("inputs", inputs, len(w.inputs)),
                                    ("counters", counters, w.counters)):  # fmt: skip
            if there != needed:
                raise UserError(f"driver.port: {self.name} has {there} {what} and the machine has {needed}; "
                                "set the same number in the firmware")  # fmt: skip
        lacks = [n for n in w.lines if not lines >> n & 1]
        if lacks:
            raise UserError(f"driver.port: {self.name} cannot write line {', '.join(map(str, lacks))}")

    def _write(self, codes: Sequence[int]) -> None:
        for n, code in enumerate(codes):
            self._line["outputs"][n] = code * self.outputs[n].volts_per_code
        self._ship()

    def _write_code(self, n: int, code: int) -> None:
        self._line["outputs"][n] = code * self.outputs[n].volts_per_code
        self._ship()

    def _write_lines(self, bits: int) -> None:
        self._levels = bits & ((1 << LINES) - 1)  # sent with the outputs, in one frame

    def enable(self, on: bool) -> None:
        """Set the state, on or off, that the next frame reports to the device."""
        self._on = int(on)

    def zero(self) -> None:
        """Send outputs zero, lines low and state off, in one frame. Raises BoardError where it cannot be sent."""
        self._line["outputs"], self._on, self._levels = 0.0, 0, 0
        self._ship()

    def _ship(self) -> None:
        self.unread = True
        self._sent(frame.drive(self._line, self._on, self._levels), "outputs")

    def _read_counts(self) -> Sequence[int]:
        line = self._line
        if not self.unread:  # another read without a write: send the outputs again
            self._ship()
        self._received(frame.sample(line, self._patience))
        self.unread = False
        self._look()
        counts = line["counts"][: self.wiring.counters]
        return [daq_stc.INITIAL_COUNT + int(n) - start for n, start in zip(counts, self._start, strict=True)]

    def _look(self) -> None:
        """Raise BoardError where the device is late or silent, or reports a fault."""
        line, now = self._line, time.monotonic_ns()
        age, silent = ((now - int(line[at])) / 1e6 for at in ("answered_at", "heard_at"))
        limit = self.settings.timeout * 1e3
        if age > limit:
            garbled = int(line["garbled"])
            seen = f"; {garbled} frames came garbled: check baud, ground and cable" if garbled else ""
            what = (f"has not answered for {age:.0f} ms" if silent > limit / 2
                    else f"answers late: its newest sample is for outputs of {age:.0f} ms ago")  # fmt: skip
            raise BoardError(f"{self.name}: the device {what}, and driver.timeout is {limit:g} ms{seen}")
        if line["fault"]:
            raise BoardError(f"{self.name}: the device reports fault {int(line['fault'])}; its firmware says which")

    def _read_volts(self) -> Sequence[float]:
        return [float(value) for value in self._line["inputs"][: len(self.inputs)]]

    def _close(self) -> None:
        if self._fd >= 0 and self._given is None:
            with contextlib.suppress(OSError):
                os.close(self._fd)
        self._fd = -1


def check(wiring: Wiring) -> None:
    """Raise UserError where a machine has more outputs, inputs or counters than a frame can hold."""
    for what, n in (("outputs", len(wiring.outputs)), ("inputs", len(wiring.inputs)), ("counters", wiring.counters)):
        if n > frame.MOST:
            raise UserError(f"driver: the machine has {n} {what}; a serial board carries {frame.MOST}")


def _compile() -> None:
    """Compile all functions before the run, by calls on an invalid file descriptor."""
    line = np.zeros(1, frame.LINE)[0]
    line["fd"] = -1
    frame.say_hello(line, 0)
    frame.drive(line, 0, 0)
    frame.sample(line, 0)
    frame.drain(line)


def connect(settings: SerialSettings) -> int:
    """File descriptor of a line in raw mode. Raises UserError."""
    if settings.baud not in BAUDS:
        raise UserError(f"driver.baud: {settings.baud} is no rate of a serial line here; there is "
                        f"{', '.join(map(str, sorted(BAUDS)))}")  # fmt: skip
    try:
        fd = os.open(settings.port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError as error:
        raise UserError(f"driver.port: {_refusal(settings.port, error.errno or 0)}") from None
    try:
        tty.setraw(fd)
        mode = termios.tcgetattr(fd)
        mode[2] |= termios.CLOCAL | termios.CREAD
        mode[4] = mode[5] = getattr(termios, f"B{settings.baud}")
        termios.tcsetattr(fd, termios.TCSANOW, mode)
        termios.tcflush(fd, termios.TCIOFLUSH)
    except termios.error as error:
        os.close(fd)
        raise UserError(f"driver.port: {settings.port} is no serial line ({error.args[-1]})") from None
    return fd


def _refusal(port: str, code: int) -> str:
    """Error message with remedy for a device file that does not open."""
    if code == errno.ENOENT:
        return f"there is no {port}; plug the device in, see `ls /dev/ttyACM* /dev/ttyUSB*`"
    if code in (errno.EACCES, errno.EPERM):
        return f"this account may not open {port}; `sudo usermod -aG dialout $USER`, then log in again"
    if code == errno.EBUSY:
        return f"{port} belongs to another program; end it"
    return f"{port} does not open: {os.strerror(code)}"
