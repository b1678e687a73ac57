"""Board of a real card through Comedi: libcomedi's C API by ctypes, one synchronous call for each channel.

Comedi's driver ni_atmio supports the AT-MIO-16DE-10 of the thesis. Its DAQ-STC counts pulses with a direction, so an
LS7084 is needed between encoder and counter. A card with quadrature decoders (M series) takes A and B directly.

Source: comedilib.h and comedi.h of Comedilib 0.11; ni_atmio.c and ni_mio_common.c for the card; NI, AT-MIO E Series
User Manual for the pins: PFI 8 and 3 are the sources of counters 0 and 1, DIO 6 and 7 say up or down.
Never run on a card: see docs/hardware.md.
"""

import contextlib
import ctypes
import ctypes.util
import errno
from collections.abc import Sequence
from ctypes import POINTER, byref, c_char_p, c_double, c_int, c_uint, c_void_p
from typing import Any, Literal, NamedTuple

from pydantic import Field

from rtctl.config.errors import UserError
from rtctl.drivers import at_mio_16de as mio
from rtctl.drivers import daq_stc
from rtctl.drivers.board import Board, BoardError, Wiring, input_range, output_range
from rtctl.idiom import Settings, quantity

AI, AO, DIO, COUNTER = 1, 2, 5, 6  # comedi_subdevice_type
AREF = {"rse": 0, "nrse": 1, "differential": 2}  # AREF_GROUND, AREF_COMMON, AREF_DIFF
OUTPUT, INPUT = 1, 0  # comedi_dio_config
VOLTS = 0  # UNIT_volt of a range
HW_UP_DOWN = 0x2 << 24  # NI_GPCT_COUNTING_DIRECTION_HW_UP_DOWN_BITS
QUADRATURE = {1: 0x1 << 16, 2: 0x2 << 16, 4: 0x3 << 16}  # NI_GPCT_COUNTING_MODE_QUADRATURE_X?_BITS
ARM_NOW = 0x0  # NI_GPCT_ARM_IMMEDIATE
NO_GATE = 0x8000  # NI_GPCT_DISABLED_GATE_SELECT
GATES = (0, 1)
ENCODER_A, ENCODER_B = 0, 1  # NI_GPCT_SOURCE_ENCODER_?
SOURCE_PFI = (8, 3)  # source pins of counters 0 and 1
PHASE_PFI = ((8, 10), (3, 11))  # pins A and B of counters 0 and 1, M series
SEARCH = ("comedi",)


def pfi_clock(pin: int) -> int:
    """NI_GPCT_PFI_CLOCK_SRC_BITS."""
    return 0x20 + pin


def pfi_other(pin: int) -> int:
    """NI_GPCT_PFI_OTHER_SELECT, which is NI_USUAL_PFI_SELECT: 1 to 10, then 0x14 and up (M series)."""
    return 1 + pin if pin < 10 else 0xB + pin


class ComediSettings(Settings):
    """Settings of a card with a Comedi driver."""

    kind: Literal["comedi"] = "comedi"
    device: str = Field("/dev/comedi0", description="device file of the card")
    board: str | None = Field(
        None, description="name of the card as Comedi gives it, e.g. at-mio-16de-10; any if absent"
    )
    encoders: Literal["ls7084", "quadrature"] = Field(
        "ls7084",
        description="ls7084: pulses on the counter's source, direction on DIO 6 and 7; quadrature: A and B on the card",
    )
    rate: float | None = quantity(None, unit="Hz", gt=0, le=50e3, help="samples a second; as the loop's if absent")
    library: str | None = Field(None, description="path of libcomedi; searched for if absent")

    @property
    def place(self) -> str:
        """Device file, for messages."""
        return self.device


class Range(ctypes.Structure):
    """comedi_range."""

    _fields_ = [("min", c_double), ("max", c_double), ("unit", c_uint)]


class Channel(NamedTuple):
    """Comedi's address of a channel, and the conversion of its raw numbers to volts."""

    number: int
    range: int
    aref: int
    limits: Any  # pointer to Range
    maxdata: int
    exact: bool  # the card's bits are those of the config: raw is code - code_min


PROTOTYPES: dict[str, tuple[Any, list[Any]]] = {
    "comedi_open": (c_void_p, [c_char_p]),
    "comedi_close": (c_int, [c_void_p]),
    "comedi_errno": (c_int, []),
    "comedi_strerror": (c_char_p, [c_int]),
    "comedi_get_driver_name": (c_char_p, [c_void_p]),
    "comedi_get_board_name": (c_char_p, [c_void_p]),
    "comedi_find_subdevice_by_type": (c_int, [c_void_p, c_int, c_uint]),
    "comedi_get_n_channels": (c_int, [c_void_p, c_uint]),
    "comedi_get_maxdata": (c_uint, [c_void_p, c_uint, c_uint]),
    "comedi_get_n_ranges": (c_int, [c_void_p, c_uint, c_uint]),
    "comedi_get_range": (POINTER(Range), [c_void_p, c_uint, c_uint, c_uint]),
    "comedi_lock": (c_int, [c_void_p, c_uint]),
    "comedi_unlock": (c_int, [c_void_p, c_uint]),
    "comedi_to_phys": (c_double, [c_uint, POINTER(Range), c_uint]),
    "comedi_from_phys": (c_uint, [c_double, POINTER(Range), c_uint]),
    "comedi_data_read": (c_int, [c_void_p, c_uint, c_uint, c_uint, c_uint, POINTER(c_uint)]),
    "comedi_data_write": (c_int, [c_void_p, c_uint, c_uint, c_uint, c_uint, c_uint]),
    "comedi_dio_config": (c_int, [c_void_p, c_uint, c_uint, c_uint]),
    "comedi_dio_bitfield": (c_int, [c_void_p, c_uint, c_uint, POINTER(c_uint)]),
    "comedi_reset": (c_int, [c_void_p, c_uint]),
    "comedi_arm": (c_int, [c_void_p, c_uint, c_uint]),
    "comedi_set_counter_mode": (c_int, [c_void_p, c_uint, c_uint, c_uint]),
    "comedi_set_clock_source": (c_int, [c_void_p, c_uint, c_uint, c_uint, c_uint]),
    "comedi_set_gate_source": (c_int, [c_void_p, c_uint, c_uint, c_uint, c_uint]),
    "comedi_set_other_source": (c_int, [c_void_p, c_uint, c_uint, c_uint, c_uint]),
}


def load(path: str | None) -> Any:
    """libcomedi with its prototypes. Raises UserError where it is missing or lacks a function."""
    found = path or next(filter(None, map(ctypes.util.find_library, SEARCH)), None)
    if found is None:
        raise UserError("driver: libcomedi is not installed here; `apt install libcomedi0`, or give driver.library")
    try:
        library = ctypes.CDLL(found)
        for name, (result, arguments) in PROTOTYPES.items():
            call = getattr(library, name)
            call.restype, call.argtypes = result, arguments
    except (OSError, AttributeError) as error:
        raise UserError(f"driver.library: {found} is no libcomedi 0.11 or newer ({error})") from error
    return library


class ComediCard(Board):
    """A card at a Comedi device file."""

    def __init__(self, settings: ComediSettings, wiring: Wiring) -> None:
        super().__init__(wiring)
        self.settings = settings
        self._lib: Any = None
        self._dev: Any = None
        self._board = ""
        self._locked: list[int] = []
        self._word = c_uint()

    @property
    def name(self) -> str:
        return f"{self.settings.device}" + (f" ({self._board})" if self._board else "")

    def _open(self) -> None:
        self._lib = load(self.settings.library)
        self._dev = self._lib.comedi_open(self.settings.device.encode())
        if not self._dev:
            raise UserError(refusal(self.settings.device, self._lib.comedi_errno(), self._why()))
        self._board = self._lib.comedi_get_board_name(self._dev).decode()
        if self.settings.board is not None and self._board != self.settings.board:
            raise UserError(f"driver.board: {self.settings.device} is a {self._board}, not a {self.settings.board}; "
                            "wire the card that the config names, or change the name")  # fmt: skip
        w = self.wiring
        self._ao = self._subdevice(AO, "analog outputs", max(o.channel for o in w.outputs) + 1)
        self._out = [
            self._channel(self._ao, s.channel, p, output_range(p), 0, s.reference == "external", f"output {s.channel}")
            for s, p in zip(w.outputs, self.outputs, strict=True)
        ]
        self._lock(self._ao, "analog outputs")
        if w.inputs:
            highest = max(i.channel + (8 if i.mode == "differential" else 0) for i in w.inputs)
            self._ai = self._subdevice(AI, "analog inputs", highest + 1)
        self._in = [
            self._channel(self._ai, s.channel, p, input_range(p), AREF[s.mode], False, f"input {s.channel}")
            for s, p in zip(w.inputs, self.inputs, strict=True)
        ]
        counting = [daq_stc.DIO_LINE[n] for n in range(w.counters)] if self.settings.encoders == "ls7084" else []
        if w.lines or counting:
            self._dio = self._subdevice(DIO, "digital lines", max([*w.lines, *counting]) + 1)
            for line in (*w.lines, *counting):
                direction = OUTPUT if line in w.lines else INPUT
                self._set(self._lib.comedi_dio_config(self._dev, self._dio, line, direction), f"line {line}")
        self._counters: list[int] = []
        for n in range(w.counters):
            after = self._counters[-1] + 1 if self._counters else 0
            self._counters.append(self._subdevice(COUNTER, f"counter {n}", 1, after))
            self._start_counter(n)

    def _start_counter(self, n: int) -> None:
        """Start a counter at the middle of 24 bits, without a gate."""
        lib, dev, sub = self._lib, self._dev, self._counters[n]
        what = f"counter {n}"
        if lib.comedi_get_maxdata(dev, sub, 0) < daq_stc.SIZE - 1:
            raise UserError(f"driver: {what} of {self.name} has fewer than the 24 bits of the DAQ-STC")
        self._set(lib.comedi_reset(dev, sub), what)
        self._set(lib.comedi_data_write(dev, sub, 0, 0, 0, daq_stc.INITIAL_COUNT), what)
        for gate in GATES:
            if lib.comedi_set_gate_source(dev, sub, 0, gate, NO_GATE) < 0 and gate == 0:
                raise self._refused(what)  # the DAQ-STC has no second gate; other chips need it off
        mode = HW_UP_DOWN
        if self.settings.encoders == "quadrature":
            mode |= QUADRATURE[4]
            for phase, pin in zip((ENCODER_A, ENCODER_B), PHASE_PFI[n], strict=True):
                self._set(lib.comedi_set_other_source(dev, sub, 0, phase, pfi_other(pin)), what)
        else:
            self._set(lib.comedi_set_clock_source(dev, sub, 0, pfi_clock(SOURCE_PFI[n]), 0), what)
        self._set(lib.comedi_set_counter_mode(dev, sub, 0, mode), what)
        self._set(lib.comedi_arm(dev, sub, ARM_NOW), what)

    def _read_volts(self) -> Sequence[float]:
        volts = []
        for p, c in zip(self.inputs, self._in, strict=True):
            raw = self._data(self._ai, c.number, c.range, c.aref, f"input {c.number}")
            exact = p.volts_per_code * (raw + p.code_min)
            volts.append(exact if c.exact else self._lib.comedi_to_phys(raw, c.limits, c.maxdata))
        return volts

    def _read_counts(self) -> Sequence[int]:
        return [self._data(sub, 0, 0, 0, f"counter {n}") for n, sub in enumerate(self._counters)]

    def _write_code(self, n: int, code: int) -> None:
        p, c = self.outputs[n], self._out[n]
        raw = code - p.code_min if c.exact else self._lib.comedi_from_phys(code * p.volts_per_code, c.limits, c.maxdata)
        if self._lib.comedi_data_write(self._dev, self._ao, c.number, c.range, c.aref, raw) < 0:
            raise BoardError(f"{self.name}: writing output {c.number}: {self._why()}")

    def _write_lines(self, bits: int) -> None:
        self._word.value = bits
        if self._lib.comedi_dio_bitfield(self._dev, self._dio, self.wiring.mask, byref(self._word)) < 0:
            raise BoardError(f"{self.name}: writing lines {list(self.wiring.lines)}: {self._why()}")

    def _close(self) -> None:
        if self._dev:
            for sub in self._locked:
                with contextlib.suppress(Exception):
                    self._lib.comedi_unlock(self._dev, sub)
            self._locked = []
            self._lib.comedi_close(self._dev)
        self._dev = None

    # Comedi's calls, with errors as messages

    def _data(self, sub: int, channel: int, range_: int, aref: int, what: str) -> int:
        if self._lib.comedi_data_read(self._dev, sub, channel, range_, aref, byref(self._word)) < 0:
            raise BoardError(f"{self.name}: reading {what}: {self._why()}")
        return int(self._word.value)

    def _subdevice(self, kind: int, what: str, channels: int, after: int = 0) -> int:
        sub = int(self._lib.comedi_find_subdevice_by_type(self._dev, kind, after))
        if sub < 0:
            raise UserError(f"driver: {self.name} has no {what}; choose another device file or card")
        there = self._lib.comedi_get_n_channels(self._dev, sub)
        if there < channels:
            raise UserError(f"driver: {self.name} has {there} {what}, the config uses number {channels - 1}; "
                            f"0 to {there - 1} exist")  # fmt: skip
        return sub

    def _channel(
        self,
        sub: int,
        number: int,
        p: mio.AnalogInputParams | mio.AnalogOutputParams,
        limits: tuple[float, float],
        aref: int,
        external: bool,
        what: str,
    ) -> Channel:
        """Channel with the range `limits`, V. Raises UserError where the card has no such range."""
        lib, dev = self._lib, self._dev
        wanted = (p.code_min / -p.code_min if p.code_min else 0.0, 1.0) if external else limits
        maxdata = int(lib.comedi_get_maxdata(dev, sub, number))
        offered = []
        for n in range(lib.comedi_get_n_ranges(dev, sub, number)):
            there = lib.comedi_get_range(dev, sub, number, n)
            low, high, unit = there.contents.min, there.contents.max, there.contents.unit
            offered.append(f"{low:g} to {high:g}" + ("" if unit == VOLTS else " x EXTREF"))
            if abs(low - wanted[0]) + abs(high - wanted[1]) < 1e-6 and (unit == VOLTS) != external:
                exact = maxdata == p.code_max - p.code_min
                if external and not exact:
                    break
                return Channel(number, n, aref, there, maxdata, exact)
        raise UserError(f"driver: {what} of {self.name} has no range of {limits[0]:g} to {limits[1]:g} V"
                        f"{' by EXTREF' if external else ''}; it has {', '.join(offered)} V")  # fmt: skip

    def _lock(self, sub: int, what: str) -> None:
        if self._lib.comedi_lock(self._dev, sub) < 0:
            raise UserError(
                f"driver: the {what} of {self.name} belong to another program ({self._why()}); stop it first"
            )
        self._locked.append(sub)

    def _set(self, result: int, what: str) -> None:
        if result < 0:
            raise self._refused(what)

    def _refused(self, what: str) -> UserError:
        return UserError(f"driver: {self.name} does not let {what} be set up for encoders: {self.settings.encoders} "
                         f"({self._why()})")  # fmt: skip

    def _why(self) -> str:
        return str(self._lib.comedi_strerror(self._lib.comedi_errno()).decode())


def refusal(device: str, code: int, why: str) -> str:
    """Error message with remedy for a device file that does not open."""
    if code == errno.ENOENT:
        return (
            f"driver.device: there is no {device}; load the card's module (`modprobe ni_atmio`), see `ls /dev/comedi*`"
        )
    if code in (errno.EACCES, errno.EPERM):
        return (f"driver.device: this account may not open {device}; join its group (`sudo usermod -aG iocard $USER`, "
                "then log in again), see docs/hardware.md")  # fmt: skip
    if code in (errno.ENODEV, errno.ENXIO):
        return f"driver.device: no card is configured at {device}; `comedi_config {device} ni_atmio`, or another number"
    return f"driver.device: {device} does not open: {why}"
