"""Board of a real card through NI-DAQmx: National Instruments' `nidaqmx` package (`pip install 'rtctl[nidaqmx]'`).

For current cards (X and M series); DAQmx does not support the AT-MIO. One task for the outputs, one for the inputs, one
for each counter, and one for the digital lines that the loop writes. With `timing: hardware` the card's clock triggers
the samples and a read waits for the next one; otherwise each read takes a sample.

Source: NI-DAQmx Python documentation (stream_readers, stream_writers); NI-DAQmx Help, Hardware-Timed Single Point.
Never run on a card: see docs/hardware.md.
"""

import contextlib
import functools
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from pydantic import Field

from rtctl.config.errors import UserError, nearest
from rtctl.drivers import daq_stc
from rtctl.drivers.board import Board, BoardError, Wiring, input_range, output_range
from rtctl.idiom import Settings, quantity

TERMINALS = {"rse": "RSE", "nrse": "NRSE", "differential": "DIFF"}
TIMEOUT = 0.1  # s for a call; after it the card has failed


class NidaqmxSettings(Settings):
    """Settings of a card with NI-DAQmx."""

    kind: Literal["nidaqmx"] = "nidaqmx"
    device: str = Field("Dev1", description="name of the card in NI MAX or `nilsdev`")
    port: int = Field(0, ge=0, description="digital port of the lines that the loop writes")
    encoders: Literal["ls7084", "quadrature"] = Field(
        "quadrature",
        description="quadrature: A and B on the card; ls7084: pulses on the counter's source, direction on its pin",
    )
    timing: Literal["on_demand", "hardware"] = Field(
        "on_demand", description="on_demand: sampled when asked; hardware: by the card's clock (single point)"
    )
    rate: float | None = quantity(None, unit="Hz", gt=0, le=50e3, help="samples a second; as the loop's if absent")

    @property
    def place(self) -> str:
        """Device name, for messages."""
        return self.device


class NidaqmxCard(Board):
    """Board of a card by its DAQmx name. `rate` is the sample clock's rate, Hz, with `timing: hardware`."""

    def __init__(self, settings: NidaqmxSettings, wiring: Wiring, rate: float) -> None:
        super().__init__(wiring)
        self.settings, self.rate = settings, rate
        self._tasks: list[Any] = []
        self._product = ""
        self._volts = np.zeros(len(self.outputs))
        self._read_into = np.zeros(len(self.inputs))
        self._error: type[Exception] = RuntimeError

    @property
    def name(self) -> str:
        return self.settings.device + (f" ({self._product})" if self._product else "")

    def _open(self) -> None:
        try:
            import nidaqmx
            from nidaqmx import constants, stream_readers, stream_writers
        except ImportError as error:
            raise UserError("driver: nidaqmx is not installed here; `pip install 'rtctl[nidaqmx]'`") from error
        self._error = nidaqmx.DaqError
        self._daqmx, self._constants = nidaqmx, constants
        self._readers, self._writers = stream_readers, stream_writers
        try:
            self._product = self._find()
            self._open_outputs()
            self._open_lines()
            self._open_inputs()
            self._open_counters()
        except nidaqmx.DaqError as error:
            raise UserError(f"driver: {self.name}: {brief(error)}") from error
        except (nidaqmx.errors.DaqNotFoundError, nidaqmx.errors.DaqNotSupportedError) as error:
            raise UserError("driver: NI-DAQmx itself is not installed here; see ni.com/downloads, and "
                            "docs/hardware.md for what Linux needs") from error  # fmt: skip

    def _find(self) -> str:
        """Product name of the card. Raises UserError where the card is missing or lacks a channel."""
        system = self._daqmx.system.System.local()
        names = list(system.devices.device_names)
        if self.settings.device not in names:
            near = nearest(self.settings.device, names)
            raise UserError(f"driver.device: there is no {self.settings.device}; "
                            + (f"DAQmx has {', '.join(names)}" if names else "DAQmx has no card at all; see `nilsdev`")
                            + (f"; did you mean '{near}'?" if near else ""))  # fmt: skip
        device = self._daqmx.system.Device(self.settings.device)
        for what, there, used in (
            ("analog output", device.ao_physical_chans, [f"ao{o.channel}" for o in self.wiring.outputs]),
            ("analog input", device.ai_physical_chans, [f"ai{i.channel}" for i in self.wiring.inputs]),
            ("counter", device.ci_physical_chans, [f"ctr{n}" for n in range(self.wiring.counters)]),
        ):
            have = [name.rpartition("/")[2] for name in there.channel_names]
            for channel in used:
                if channel not in have:
                    raise UserError(f"driver: {self.settings.device} has no {what} {channel}; it has "
                                    f"{', '.join(have) or 'none'}")  # fmt: skip
        return str(device.product_type)

    def _task(self) -> Any:
        task = self._daqmx.Task()
        self._tasks.append(task)
        return task

    def _open_outputs(self) -> None:
        task = self._task()
        for settings, p in zip(self.wiring.outputs, self.outputs, strict=True):
            if settings.reference == "external":
                raise UserError(f"driver: output {settings.channel} of {self.name}: an external reference is for "
                                "comedi; write 'reference: internal'")  # fmt: skip
            low, high = output_range(p)
            task.ao_channels.add_ao_voltage_chan(f"{self.settings.device}/ao{settings.channel}", "", low, high)
        self._out = self._writers.AnalogMultiChannelWriter(task.out_stream, auto_start=True)
        self._out.verify_array_shape = False

    def _open_lines(self) -> None:
        if self.wiring.lines:
            task = self._task()
            port = f"{self.settings.device}/port{self.settings.port}"
            lines = ",".join(f"{port}/line{line}" for line in self.wiring.lines)
            task.do_channels.add_do_chan(lines, "", self._constants.LineGrouping.CHAN_FOR_ALL_LINES)
            self._line_out = self._writers.DigitalSingleChannelWriter(task.out_stream, auto_start=True)

    def _open_inputs(self) -> None:
        if not self.wiring.inputs:
            return
        task = self._task()
        for settings, p in zip(self.wiring.inputs, self.inputs, strict=True):
            low, high = input_range(p)
            task.ai_channels.add_ai_voltage_chan(
                f"{self.settings.device}/ai{settings.channel}",
                "",
                self._constants.TerminalConfiguration[TERMINALS[settings.mode]],
                low,
                high,
            )
        if self.settings.timing == "hardware":
            task.timing.cfg_samp_clk_timing(
                self.rate, sample_mode=self._constants.AcquisitionType.HW_TIMED_SINGLE_POINT
            )
        task.start()
        self._in = self._readers.AnalogMultiChannelReader(task.in_stream)
        self._in.verify_array_shape = False

    def _open_counters(self) -> None:
        self._counters: list[Callable[[], Any]] = []
        for n in range(self.wiring.counters):
            task = self._task()
            where = f"{self.settings.device}/ctr{n}"
            if self.settings.encoders == "quadrature":
                task.ci_channels.add_ci_ang_encoder_chan(
                    where,
                    "",
                    self._constants.EncoderType.X_4,
                    units=self._constants.AngleUnits.TICKS,
                    initial_angle=float(daq_stc.INITIAL_COUNT),
                )
            else:
                task.ci_channels.add_ci_count_edges_chan(
                    where,
                    "",
                    initial_count=daq_stc.INITIAL_COUNT,
                    count_direction=self._constants.CountDirection.EXTERNAL_SOURCE,
                )
            task.start()
            reader = self._readers.CounterReader(task.in_stream)
            scaled = self.settings.encoders == "quadrature"  # positions are floats, even in ticks
            read = reader.read_one_sample_double if scaled else reader.read_one_sample_uint32
            self._counters.append(functools.partial(read, TIMEOUT))

    def _read_volts(self) -> Sequence[float]:
        self._call("reading inputs", lambda: self._in.read_one_sample(self._read_into, TIMEOUT))
        return self._read_into  # type: ignore[return-value]

    def _read_counts(self) -> Sequence[int]:
        return [int(self._call(f"reading counter {n}", read)) for n, read in enumerate(self._counters)]

    def _write(self, codes: Sequence[int]) -> None:
        """Write all outputs in one call, so that the card changes them together."""
        for n, code in enumerate(codes):
            self._volts[n] = code * self.outputs[n].volts_per_code
        self._call("writing outputs", lambda: self._out.write_one_sample(self._volts, TIMEOUT))

    def _write_code(self, n: int, code: int) -> None:
        self._volts[n] = code * self.outputs[n].volts_per_code
        self._call("writing outputs", lambda: self._out.write_one_sample(self._volts, TIMEOUT))

    def _write_lines(self, bits: int) -> None:
        self._call("writing lines", lambda: self._line_out.write_one_sample_port_uint32(bits, TIMEOUT))

    def _close(self) -> None:
        while self._tasks:
            with contextlib.suppress(Exception):  # close the others after an error
                self._tasks.pop().close()

    def _call(self, what: str, call: Callable[[], Any]) -> Any:
        try:
            return call()
        except self._error as error:
            raise BoardError(f"{self.name}: {what}: {brief(error)}") from error


def brief(error: Exception) -> str:
    """First line of a DAQmx error message, which may fill a page."""
    return str(error).strip().split("\n")[0].strip()
