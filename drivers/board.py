"""Interface of all boards, emulated or real: samples in, codes out, outputs to zero at every error.

A board uses the frame of the link: codes of the machine's converters, counts modulo 2^24, digital lines as bits.
`Board` checks and converts, and sets the outputs to zero at open, at close and at every error. A card implements
`_open`, `_read_volts`, `_read_counts`, `_write_code`, `_write_lines` and `_close`, and `enable` if it can switch its
drives.

An output or input is a channel of a card (volts), or a `Quantity` of a described machine (unit of a drive's command, SI
unit of a sensor), which boards on a bus transmit as a number.

Source: thesis 7.1.1 and appendix D for the order of the calls: mdlStart, mdlOutputs, mdlTerminate.
"""

import contextlib
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from rtctl.drivers import at_mio_16de as mio
from rtctl.drivers import daq_stc
from rtctl.idiom import Settings

LINES = 8  # digital lines of the board's port
DT = 1.0  # s, dummy: the range of a channel does not depend on the period


class EmulatedSettings(Settings):
    """Settings without a card: the board is emulated with the machine."""

    kind: Literal["emulated"] = Field("emulated", description="the machine and its board are emulated")


class Quantity(NamedTuple):
    """A code of the frame without a channel of a card: a drive's command, or a reading of a sensor."""

    name: str
    unit: str
    params: Any  # AnalogOutputParams or AnalogInputParams, with `unit` in place of volts

    @property
    def channel(self) -> str:
        """Name in messages."""
        return self.name


class Wiring(NamedTuple):
    """Channels that a machine uses, in the order of the frame's codes."""

    outputs: tuple[Any, ...]  # AnalogOutputSettings of a card's channel, or a Quantity
    inputs: tuple[Any, ...] = ()  # AnalogInputSettings, or a Quantity
    counters: int = 1  # counters 0 to n - 1 hold encoders
    lines: tuple[int, ...] = ()  # digital lines that the loop writes; the others are inputs
    drives: tuple[str, ...] = ()  # names of the outputs, for boards on a bus
    sensors: tuple[str, ...] = ()  # names of the counters, then of the inputs
    measures: tuple[str, ...] = ()  # quantity of each sensor: position, speed, current or force
    turns: tuple[float | None, ...] = ()  # counts or SI units of each sensor per turn of its body, where known

    @property
    def mask(self) -> int:
        """Bits of the lines that the loop writes."""
        return sum(1 << line for line in self.lines)


class BoardError(Exception):
    """Failure of a card in a run, with the operation, the channel and the card's message."""


class Board(ABC):
    """A card with a machine's wiring. Open it before use; it may be closed twice."""

    def __init__(self, wiring: Wiring) -> None:
        self.wiring = wiring
        self.outputs = [o.params if isinstance(o, Quantity) else mio.build_output(o, DT, 0) for o in wiring.outputs]
        self.inputs = [input_params(i) for i in wiring.inputs]
        self.is_open = False
        self.failed: BoardError | None = None  # the first error since it was opened

    @property
    def name(self) -> str:
        """Name of the card for messages."""
        return type(self).__name__

    def open(self) -> "Board":
        """Open the card, set up its channels, and set its outputs to zero. Raises UserError where that fails."""
        try:
            self._open()
            self.is_open = True
            self.zero()
        except BaseException:
            self.close()
            raise
        return self

    def read(self, frame: Any) -> None:
        """Read counters and inputs into `frame.counter_codes` and `frame.ai_codes`. Raises BoardError.

        A failed read sets the outputs to zero: a machine without readings cannot be controlled.
        """
        with self._guarded():
            counts = self._read_counts()
            volts = self._read_volts() if self.inputs else ()
            for n, count in enumerate(counts):
                frame["counter_codes"][n] = int(count) & (daq_stc.SIZE - 1)
            for n, (value, p) in enumerate(zip(volts, self.inputs, strict=True)):
                if not math.isfinite(value):
                    raise BoardError(f"{self.name}: input {self.wiring.inputs[n].channel} reads {value}")
                frame["ai_codes"][n] = nearest_code(p, value)

    def write(self, codes: Sequence[int], lines: int) -> None:
        """Write the codes of the outputs, and the levels of the digital lines. Raises BoardError, with outputs zero."""
        with self._guarded():
            for n, p in enumerate(self.outputs):
                if not p.code_min <= codes[n] <= p.code_max:
                    raise BoardError(f"{self.name}: code {codes[n]} for output {self.wiring.outputs[n].channel} lies "
                                     f"beyond {p.code_min} to {p.code_max}")  # fmt: skip
            if self.wiring.lines:  # first: a drive must know its direction before it gets its volts
                self._write_lines(lines & self.wiring.mask)
            self._write([int(codes[n]) for n in range(len(self.outputs))])

    def zero(self) -> None:
        """Set all outputs to 0 V and all written lines low. Raises BoardError after trying all of them."""
        troubles = []
        for n in range(len(self.outputs)):
            try:
                self._write_code(n, 0)
            except BoardError as error:
                troubles.append(str(error))
        if self.wiring.lines:
            try:
                self._write_lines(0)
            except BoardError as error:
                troubles.append(str(error))
        if troubles:
            raise BoardError("; ".join(troubles))

    def enable(self, on: bool) -> None:  # noqa: B027  most cards have no such switch
        """Switch the power of the drives, where the board can; called when the machine is switched on or off."""

    def close(self) -> None:
        """Set the outputs to zero, then close the card."""
        if self.is_open:
            with contextlib.suppress(BoardError):
                self.zero()
        self.is_open = False
        self._close()

    @contextlib.contextmanager
    def _guarded(self) -> Any:
        if not self.is_open:
            raise BoardError(f"{self.name}: it is not open")
        try:
            yield
        except BaseException as error:
            with contextlib.suppress(BoardError):
                self.zero()
            if isinstance(error, BoardError) and self.failed is None:
                self.failed = error
            raise

    def _write(self, codes: Sequence[int]) -> None:
        for n, code in enumerate(codes):
            self._write_code(n, code)

    # Methods that a card implements; `n` is the index of a channel in the wiring

    @abstractmethod
    def _open(self) -> None: ...

    @abstractmethod
    def _read_volts(self) -> Sequence[float]: ...

    @abstractmethod
    def _read_counts(self) -> Sequence[int]: ...

    @abstractmethod
    def _write_code(self, n: int, code: int) -> None: ...

    @abstractmethod
    def _write_lines(self, bits: int) -> None: ...

    @abstractmethod
    def _close(self) -> None: ...


def input_params(wire: Any) -> mio.AnalogInputParams:
    """Parameters (range and step) of an input, a channel or a Quantity."""
    found: mio.AnalogInputParams = wire.params if isinstance(wire, Quantity) else mio.build_input(wire, DT)
    return found


def nearest_code(p: mio.AnalogInputParams, volts: float) -> int:
    """Code nearest to a voltage in V, half to even, clipped at the ends of the range."""
    return int(min(max(np.rint(volts / p.volts_per_code), p.code_min), p.code_max))


def output_range(p: mio.AnalogOutputParams) -> tuple[float, float]:
    """Range of an output in V as in a card's tables: -10 to 10, although the last code is one code below 10."""
    return p.code_min * p.volts_per_code, (p.code_max + 1) * p.volts_per_code


def input_range(p: mio.AnalogInputParams) -> tuple[float, float]:
    """Range of an input in V, as in a card's tables."""
    return p.code_min * p.volts_per_code, (p.code_max + 1) * p.volts_per_code
