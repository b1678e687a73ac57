"""Analog part of the AT-MIO-16DE-10: two 12-bit outputs and a 12-bit converter that scans up to sixteen inputs.

Loop and plant exchange codes only, as over the bus of the PC. `volts_to_codes` and `codes_to_input_volts` are for the
loop, `output_step` and `input_step` for the board in the plant.

Outputs: bipolar -V_ref..V_ref in two's complement, one code is V_ref/2048; unipolar 0..V_ref, one code is V_ref/4096.
Inputs: bipolar +-5 V/gain, unipolar 0..10 V/gain, 4096 codes over either. Converters of other cards have other `bits`.

Source: thesis 7.1.1 and appendix D (mdlCheckParameters); National Instruments, AT-MIO E Series User Manual.
Erratum: 500 kS/s is the rate of the AT-MIO-16E-2 in that manual. Comedi's board table (ni_atmio.c) has 2 us a
conversion for the 16E-2 and 10 us for the 16DE-10. The thesis's figures are kept; both are short against its period of
2 ms.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from rtctl.counted import mixed, nth
from rtctl.idiom import Settings, quantity, state, tick

INTERNAL_VOLTS = 10.0  # V, internal reference
EXTERNAL_VOLTS = 11.0  # V, largest magnitude of the external reference
WRITE = 1e-6  # s per AO_VWrite: one 16-bit cycle on the ISA bus; the outputs cannot be written together
SETTLING = 3e-6  # s, of both outputs
CONVERSION = 2e-6  # s between two inputs of a scan, at 500 kS/s
GAINS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
DITHER_CODES = 0.5  # codes rms
BITS = 12  # bits of this board's converters
MOST_BITS = 24  # most bits of a card's converter


class AnalogOutputSettings(Settings):
    channel: Literal[0, 1] = Field(description="analog output, 0 or 1")
    polarity: Literal["bipolar", "unipolar"] = Field("bipolar", description="-V_ref..V_ref or 0..V_ref")
    reference: Literal["internal", "external"] = Field("internal", description="+10 V, or the EXTREF pin")
    external_volts: float | None = quantity(None, unit="V", help="voltage at the EXTREF pin, -11 to 11 V")
    bits: int = Field(BITS, ge=8, le=MOST_BITS, description="bits of the converter; 12 on the AT-MIO-16DE-10")

    @model_validator(mode="after")
    def _check(self) -> "AnalogOutputSettings":
        if self.reference == "external" and not 0 < abs(self.external_volts or 0.0) <= EXTERNAL_VOLTS:
            raise ValueError("an external reference needs 'external_volts' between -11 and 11 V, other than 0")
        if self.reference == "internal" and self.external_volts is not None:
            raise ValueError("'external_volts' is given but the reference is internal; write 'reference: external'")
        return self


class AnalogInputSettings(Settings):
    channel: int = quantity(unit="", ge=0, le=15, help="analog input, 0 to 15; differential 0 to 7, paired with n + 8")
    gain: float = quantity(1.0, unit="", help="0.5, 1, 2, 5, 10, 20, 50 or 100")
    mode: Literal["differential", "rse", "nrse"] = Field("rse", description="what the input is measured against")
    polarity: Literal["bipolar", "unipolar"] = Field("bipolar", description="+-5 V/gain or 0..10 V/gain")
    bits: int = Field(BITS, ge=8, le=MOST_BITS, description="bits of the converter; 12 on the AT-MIO-16DE-10")

    @model_validator(mode="after")
    def _check(self) -> "AnalogInputSettings":
        if self.gain == -1.0:
            raise ValueError("gain -1 is how NI-DAQ writes one half; write 0.5")
        if self.gain not in GAINS:
            raise ValueError(f"the board has no gain {self.gain:g}; choose 0.5, 1, 2, 5, 10, 20, 50 or 100")
        if self.polarity == "unipolar" and self.gain == 0.5:
            raise ValueError("gain 0.5 exists for bipolar inputs only: 0..20 V is beyond the amplifier's supply")
        if self.mode == "differential" and self.channel > 7:
            raise ValueError(
                f"differential channel {self.channel} does not exist: inputs n and n + 8 pair, n is 0 to 7"
            )
        return self


class AnalogOutputParams(NamedTuple):
    volts_per_code: float
    code_min: int
    code_max: int
    write_order: int  # 0 for the output written first in a tick
    delay: float  # s from the start of the writes until this output moves
    settling: float  # s


class AnalogInputParams(NamedTuple):
    volts_per_code: float
    code_min: int
    code_max: int
    dither: int  # 0 or 1
    scan_delay: float  # s after the scan began
    seed: int


ANALOG_OUTPUT_STATE = state(codes=int, before=float, after=float, age=float)
ANALOG_INPUT_STATE = state(n=int)


def check_channels(what: str, channels: Sequence[int], last: int) -> None:
    """Raise ValueError unless `channels` is ascending, unique and within 0 to `last`."""
    if any(not 0 <= c <= last for c in channels) or any(a >= b for a, b in pairwise(channels)):
        raise ValueError(f"{what} {list(channels)}: channels must be ascending, each once, within 0 to {last}")


def check_inputs(inputs: Sequence[AnalogInputSettings]) -> None:
    """Raise ValueError unless the scan list is ascending and no input is both single and half of a pair."""
    check_channels("analog inputs", [i.channel for i in inputs], 15)
    single = {i.channel for i in inputs if i.mode != "differential"}
    for i in inputs:
        if i.mode == "differential" and i.channel + 8 in single:
            raise ValueError(
                f"differential input {i.channel} uses input {i.channel + 8} too, which is also scanned alone"
            )


def build_output(settings: AnalogOutputSettings, dt: float, write_order: int | None = None) -> AnalogOutputParams:
    """Parameters of an output for a tick of `dt` s. Outputs are written in channel order unless `write_order` is given.

    Raises ValueError where dt is too short for the output to settle.
    """
    order = settings.channel if write_order is None else write_order
    delay = (order + 1) * WRITE
    if dt < delay + SETTLING:
        raise ValueError(f"a period of {dt * 1e6:g} us is too short: output {settings.channel} settles in "
                         f"{(delay + SETTLING) * 1e6:g} us")  # fmt: skip
    volts = settings.external_volts if settings.reference == "external" else INTERNAL_VOLTS
    assert volts is not None
    codes = 1 << settings.bits
    if settings.polarity == "bipolar":
        return AnalogOutputParams(volts / (codes // 2), -codes // 2, codes // 2 - 1, order, delay, SETTLING)
    return AnalogOutputParams(volts / codes, 0, codes - 1, order, delay, SETTLING)


def build_input(
    settings: AnalogInputSettings, dt: float, dither: bool = False, scan_index: int = 0, seed: int = 0
) -> AnalogInputParams:
    """Parameters of the input at position `scan_index` of a scan. `dither` applies to the whole board.

    Raises ValueError where dt ends before the input is converted.
    """
    if dt < (scan_index + 1) * CONVERSION:
        raise ValueError(f"a period of {dt * 1e6:g} us is too short for {scan_index + 1} inputs of 2 us each")
    codes = 1 << settings.bits
    volts_per_code = INTERNAL_VOLTS / settings.gain / codes
    code_min, code_max = (-codes // 2, codes // 2 - 1) if settings.polarity == "bipolar" else (0, codes - 1)
    own_seed = (seed * 0x2545F491 + (settings.channel + 1) * 0x9E3779B1) & 0x7FFF_FFFF_FFFF_FFFF
    return AnalogInputParams(volts_per_code, code_min, code_max, int(dither), scan_index * CONVERSION, own_seed)


@tick
def _codes(x, code_min, code_max):
    if math.isnan(x):  # NaN gives 0 V
        return 0
    return int(min(max(np.rint(x), float(code_min)), float(code_max)))


@tick
def volts_to_codes(p, volts):
    """Code nearest to a voltage in V (half to even), clipped at the ends of the range; NaN gives the code of 0 V."""
    return _codes(volts / p.volts_per_code, p.code_min, p.code_max)


@tick
def codes_to_volts(p, codes):
    """Output voltage in V for `codes`."""
    return codes * p.volts_per_code


@tick
def output_step(p, s, codes, h):
    """Mean output voltage (V) over the next `h` s. A new code acts after its write delay, then settles linearly."""
    if codes != s.codes:
        s.before += (s.after - s.before) * min(max((s.age - p.delay) / p.settling, 0.0), 1.0)
        s.after = codes * p.volts_per_code
        s.codes = codes
        s.age = 0.0
    if s.age >= p.delay + p.settling:
        return s.after
    share = (_settled_time(p, s.age + h) - _settled_time(p, s.age)) / h
    s.age += h
    return s.before + (s.after - s.before) * share


@tick
def _settled_time(p, age):
    """Integral from 0 to `age` (s) of the settled share, in s."""
    t = age - p.delay
    if t <= 0.0:
        return 0.0
    if t < p.settling:
        return 0.5 * t * t / p.settling
    return t - 0.5 * p.settling


@tick
def input_step(p, s, volts):
    """Code for an input of `volts`; dither, where enabled, adds noise of 0.5 LSB rms before the converter."""
    x = volts / p.volts_per_code
    if p.dither != 0:
        x += DITHER_CODES * _noise(p.seed, s.n)
        s.n += 1
    return _codes(x, p.code_min, p.code_max)


@tick
def codes_to_input_volts(p, codes):
    """Input voltage in V for `codes`."""
    return codes * p.volts_per_code


@tick
def _noise(seed, n):
    """The n-th number of a nearly Gaussian sequence, mean 0, rms 1: sum of four uniforms, magnitude below 3.5.

    The uniforms are the four 16-bit parts of a hash of seed and n, so the state is only a count.
    """
    z = mixed(nth(seed, n))
    total = 0.0
    for _ in range(4):
        total += (float(z & np.uint64(0xFFFF)) + 0.5) / 65536.0
        z = z >> np.uint64(16)
    return (total - 2.0) * 1.7320508075688772  # four uniforms have a variance of a third
