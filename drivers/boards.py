"""Choice of the driver between loop and machine: `driver:` in the config."""

from typing import Annotated, Any

from pydantic import Field

from rtctl.drivers import can, serial
from rtctl.drivers.board import Board, EmulatedSettings, Wiring
from rtctl.drivers.can import CanBoard, CanSettings
from rtctl.drivers.comedi import ComediCard, ComediSettings
from rtctl.drivers.nidaqmx import NidaqmxCard, NidaqmxSettings
from rtctl.drivers.serial import SerialBoard, SerialSettings

DriverSettings = Annotated[
    EmulatedSettings | ComediSettings | NidaqmxSettings | CanSettings | SerialSettings, Field(discriminator="kind")
]
BusSettings = Annotated[EmulatedSettings | CanSettings | SerialSettings, Field(discriminator="kind")]


def make(settings: Any, wiring: Wiring, rate: float) -> Board:
    """Board of the config's `driver`, not yet open; `rate` is its sample rate, Hz.

    Raises UserError where a bus lacks a drive or a sensor of the machine.
    """
    if isinstance(settings, CanSettings):
        return CanBoard(settings, wiring, rate)
    if isinstance(settings, SerialSettings):
        return SerialBoard(settings, wiring, rate)
    if isinstance(settings, ComediSettings):
        return ComediCard(settings, wiring)
    if isinstance(settings, NidaqmxSettings):
        return NidaqmxCard(settings, wiring, rate)
    from rtctl.drivers.emulated import EmulatedCard

    return EmulatedCard(wiring)


def check(settings: Any, wiring: Wiring) -> None:
    """Raise UserError where a bus lacks a drive or a sensor of the machine; a card is checked when it is opened."""
    if isinstance(settings, CanSettings):
        can.check(settings, wiring)
    if isinstance(settings, SerialSettings):
        serial.check(wiring)
