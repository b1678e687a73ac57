"""Emulated board with the NI-DAQ calls of the thesis's driver block, by name.

Each call takes the device number first, as in C. It raises `NidaqError` where C returns an error code, and returns
values that C writes through a pointer. The plant's side is `input_volts`, `output_volts()`, `pulse()` and `dio`.

Source: thesis appendix D (ATMIO16DE.tlc); National Instruments, NI-DAQ Function Reference Manual for PC Compatibles.
"""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from rtctl.drivers import at_mio_16de as mio
from rtctl.drivers import daq_stc

AT_MIO_16DE_10 = 37  # device code

ND_COUNT = 13200
ND_COUNTER_0 = 13300
ND_COUNTER_1 = 13400
ND_HARDWARE = 18000
ND_INITIAL_COUNT = 19100
ND_PROGRAM = 29300
ND_RESET = 31200
ND_SIMPLE_EVENT_CNT = 33100
ND_UP_DOWN = 35150

CODES = {
    "badDeviceError": -10005,
    "badChanError": -10007,
    "badPolarityError": -10044,
    "badInputModeError": -10045,
    "badGainError": -10080,
    "badExtRefError": -10086,
    "badRPGError": -10090,
    "gpctrBadApplicationError": -10120,
    "gpctrBadCtrNumberError": -10121,
    "gpctrBadParamValueError": -10122,
    "gpctrBadParamIDError": -10123,
    "gpctrBadEntityIDError": -10124,
    "gpctrBadActionError": -10125,
    "invalidValueError": -10003,
    "noSetupError": -10600,
}
Mode = Literal["differential", "rse", "nrse"]
Polarity = Literal["bipolar", "unipolar"]
MODES: tuple[Mode, ...] = ("differential", "rse", "nrse")
POLARITIES: tuple[Polarity, ...] = ("bipolar", "unipolar")


class NidaqError(Exception):
    """A call that NI-DAQ would refuse, with its error code `code` as in C, and a reason."""

    def __init__(self, name: str, reason: str) -> None:
        super().__init__(f"{name} ({CODES[name]}): {reason}")
        self.name, self.code = name, CODES[name]


def _require(condition: bool, name: str, reason: str) -> None:
    if not condition:
        raise NidaqError(name, reason)


class _Counter:
    def __init__(self) -> None:
        self.state = np.zeros(1, daq_stc.COUNTER_STATE)[0]
        self.reset()

    def reset(self) -> None:
        self.application = 0
        self.initial = 0
        self.hardware = False
        self.armed = False
        self.load()

    def load(self) -> None:
        daq_stc.counter_reset(self.state)
        self.state["n"] = self.initial - daq_stc.INITIAL_COUNT

    def count(self, pulses: int, up: int) -> int:
        return int(daq_stc.counter_step(self.state, pulses, up))


class EmulatedBoard:
    """One AT-MIO-16DE-10, or a card of its family with converters of other `bits`.

    `dt` is the sample period, s, in which its outputs must settle; `seed` is the seed of its dither.
    """

    def __init__(self, device: int = 1, dt: float = 0.002, seed: int = 0, bits: int = mio.BITS) -> None:
        self.device, self.dt, self.seed, self.bits = device, dt, seed, bits
        self._reset()

    def _reset(self) -> None:
        self.input_volts = [0.0] * 16
        self.dio = [1] * 8
        self.dither = False
        self.inputs: dict[int, tuple[Mode, Polarity]] = {}
        self.scan: list[tuple[int, mio.AnalogInputParams, Any]] = []
        self.outputs: dict[int, mio.AnalogOutputParams] = {}
        self.codes = [0, 0]
        self.counters = {ND_COUNTER_0: _Counter(), ND_COUNTER_1: _Counter()}

    # The plant's side

    def output_volts(self, chan: int) -> float:
        """Settled voltage of output `chan`, V."""
        return float(mio.codes_to_volts(self.outputs[chan], self.codes[chan])) if chan in self.outputs else 0.0

    def pulse(self, counter: int, pulses: int) -> None:
        """Edges at the source of counter 0 or 1, counted in the direction of its DIO line."""
        c = self.counters[(ND_COUNTER_0, ND_COUNTER_1)[counter]]
        if c.armed:
            c.count(pulses, self.dio[daq_stc.DIO_LINE[counter]] if c.hardware else 1)

    # The calls

    def Init_DA_Brds(self, device: int) -> int:
        """Reset the board; returns its device code, 37."""
        self._check(device)
        self._reset()
        return AT_MIO_16DE_10

    def MIO_Config(self, device: int, dither: int, use_amux: int) -> None:
        """Switch dither on (1) or off (0), for all inputs."""
        self._check(device)
        _require(dither in (0, 1), "invalidValueError", f"dither is 0 or 1, not {dither}")
        _require(use_amux == 0, "invalidValueError", "there is no AMUX-64T on this board; useAMUX is 0")
        self.dither = bool(dither)

    def AI_Configure(self, device: int, chan: int, mode: int, input_range: int, polarity: int, drive_ais: int) -> None:
        """Mode 0 differential, 1 RSE, 2 NRSE; polarity 0 bipolar, 1 unipolar; range and AIS are ignored here."""
        self._check(device)
        _require(0 <= chan <= 15, "badChanError", f"analog input {chan} does not exist; 0 to 15 do")
        _require(mode in (0, 1, 2), "badInputModeError", f"mode is 0, 1 or 2, not {mode}")
        _require(polarity in (0, 1), "badPolarityError", f"polarity is 0 or 1, not {polarity}")
        _require(mode != 0 or chan < 8, "badChanError", f"differential channel {chan}: inputs n and n + 8 pair, n < 8")
        self.inputs[chan] = MODES[mode], POLARITIES[polarity]

    def SCAN_Setup(self, device: int, num_chans: int, chans: Sequence[int], gains: Sequence[float]) -> None:
        """Set the inputs of a scan, in ascending order, each with its gain; -1 stands for 0.5."""
        self._check(device)
        _require(num_chans == len(chans) == len(gains), "invalidValueError",
                 f"{num_chans} channels, but {len(chans)} numbers and {len(gains)} gains")  # fmt: skip
        settings = []
        for chan, gain in zip(chans, gains, strict=True):
            _require(chan in self.inputs, "noSetupError", f"AI_Configure was not called for input {chan}")
            real = 0.5 if gain == -1 else float(gain)
            _require(gain == -1 or real in mio.GAINS[1:], "badGainError",
                     f"gain {gain:g} of input {chan}; -1 (for 0.5), 1, 2, 5, 10, 20, 50 and 100 exist")  # fmt: skip
            mode, polarity = self.inputs[chan]
            _require(real != 0.5 or polarity == "bipolar", "badRPGError", f"input {chan}: gain 0.5 is bipolar only")
            settings.append(
                mio.AnalogInputSettings(channel=chan, gain=real, mode=mode, polarity=polarity, bits=self.bits)
            )
        try:
            mio.check_inputs(settings)
        except ValueError as error:
            raise NidaqError("badChanError", str(error)) from None
        self.scan = [
            (i.channel, mio.build_input(i, self.dt, self.dither, n, self.seed), np.zeros(1, mio.ANALOG_INPUT_STATE)[0])
            for n, i in enumerate(settings)
        ]

    def AO_Configure(self, device: int, chan: int, polarity: int, ext_ref: int, volts: float, update_mode: int) -> None:
        """Polarity 0 bipolar, 1 unipolar; reference 0 internal (10 V), 1 external of `volts`; update 0 at the write."""
        self._check(device)
        self._check_output(chan)
        _require(polarity in (0, 1), "badPolarityError", f"polarity is 0 or 1, not {polarity}")
        _require(update_mode == 0, "invalidValueError", "outputs are updated when written: update mode 0")
        _require(ext_ref in (0, 1), "badExtRefError", f"reference is 0 (internal) or 1 (external), not {ext_ref}")
        good = not ext_ref or (volts != 0 and abs(volts) <= 11)
        _require(good, "badExtRefError", f"an external reference of {volts:g} V; -11 to 11 V, not 0")
        settings = mio.AnalogOutputSettings.model_validate(
            {
                "channel": chan,
                "polarity": POLARITIES[polarity],
                "reference": "external" if ext_ref else "internal",
                "external_volts": volts if ext_ref else None,
                "bits": self.bits,
            }
        )
        self.outputs[chan] = mio.build_output(settings, self.dt)

    def GPCTR_Control(self, device: int, counter: int, action: int) -> None:
        """ND_RESET stops and clears a counter, ND_PROGRAM loads its initial count and arms it."""
        c = self._counter(device, counter)
        _require(action in (ND_RESET, ND_PROGRAM), "gpctrBadActionError", "action is ND_RESET or ND_PROGRAM")
        if action == ND_RESET:
            c.reset()
        else:
            _require(c.application != 0, "noSetupError", "GPCTR_Set_Application was not called")
            c.load()
            c.armed = True

    def GPCTR_Set_Application(self, device: int, counter: int, application: int) -> None:
        """ND_SIMPLE_EVENT_CNT: count all events."""
        c = self._counter(device, counter)
        _require(application == ND_SIMPLE_EVENT_CNT, "gpctrBadApplicationError", "application is ND_SIMPLE_EVENT_CNT")
        c.application = application

    def GPCTR_Change_Parameter(self, device: int, counter: int, parameter: int, value: int) -> None:
        """ND_UP_DOWN: ND_HARDWARE lets the DIO line give the direction. ND_INITIAL_COUNT: 0 to 2^24 - 1."""
        c = self._counter(device, counter)
        if parameter == ND_UP_DOWN:
            _require(value == ND_HARDWARE, "gpctrBadParamValueError", "the direction is ND_HARDWARE here")
            c.hardware = True
        elif parameter == ND_INITIAL_COUNT:
            _require(0 <= value < daq_stc.SIZE, "gpctrBadParamValueError", f"initial count {value}; 0 to 16777215")
            c.initial = value
        else:
            raise NidaqError("gpctrBadParamIDError", "parameter is ND_UP_DOWN or ND_INITIAL_COUNT")

    def AI_VRead_Scan(self, device: int) -> list[float]:
        """Voltages of the inputs, V, in the order of the scan."""
        self._check(device)
        _require(bool(self.scan), "noSetupError", "SCAN_Setup was not called")
        codes = [(p, mio.input_step(p, s, float(self.input_volts[chan]))) for chan, p, s in self.scan]
        return [float(mio.codes_to_input_volts(p, c)) for p, c in codes]

    def GPCTR_Watch(self, device: int, counter: int, entity: int) -> int:
        """ND_COUNT: the count, 0 to 2^24 - 1, without changing it."""
        c = self._counter(device, counter)
        _require(entity == ND_COUNT, "gpctrBadEntityIDError", "entity is ND_COUNT")
        return c.count(0, 1)

    def AO_VWrite(self, device: int, chan: int, volts: float) -> None:
        """Set output `chan` to the code nearest to `volts`, clipped to its range."""
        self._check(device)
        self._check_output(chan)
        _require(chan in self.outputs, "noSetupError", f"AO_Configure was not called for output {chan}")
        self.codes[chan] = int(mio.volts_to_codes(self.outputs[chan], float(volts)))

    def _check(self, device: int) -> None:
        _require(
            device == self.device, "badDeviceError", f"device {device} does not exist; this board is {self.device}"
        )

    def _check_output(self, chan: int) -> None:
        _require(chan in (0, 1), "badChanError", f"analog output {chan} does not exist; 0 and 1 do")

    def _counter(self, device: int, counter: int) -> _Counter:
        self._check(device)
        _require(counter in self.counters, "gpctrBadCtrNumberError", "counter is ND_COUNTER_0 or ND_COUNTER_1")
        return self.counters[counter]
