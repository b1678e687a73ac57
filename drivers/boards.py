"""Which driver stands between loop and machine: `driver:` in the config."""

from typing import Annotated

from pydantic import Field

from rtctl.drivers.board import Board, EmulatedSettings, Wiring
from rtctl.drivers.comedi import ComediCard, ComediSettings
from rtctl.drivers.nidaqmx import NidaqmxCard, NidaqmxSettings

DriverSettings = Annotated[EmulatedSettings | ComediSettings | NidaqmxSettings, Field(discriminator="kind")]


def make(settings: EmulatedSettings | ComediSettings | NidaqmxSettings, wiring: Wiring, rate: float) -> Board:
    """The card that the config names, not open yet; `rate` (Hz) is that of its samples."""
    if isinstance(settings, ComediSettings):
        return ComediCard(settings, wiring)
    if isinstance(settings, NidaqmxSettings):
        return NidaqmxCard(settings, wiring, rate)
    from rtctl.drivers.emulated import EmulatedCard

    return EmulatedCard(wiring)
