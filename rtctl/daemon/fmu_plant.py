"""An FMU in place of the emulated machine, in lockstep, behind the emulated board.

The emulator's encoders, optical sensors and converters turn the readings of the FMU into codes and counts for the loop.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from rtctl.daemon.link_end import LinkEnd
from rtctl.drivers import daq_stc, linear_scale, ls7084, optical_sensor
from rtctl.drivers.emulated import EmulatedCard
from rtctl.drivers.nidaq import EmulatedBoard
from rtctl.machines import Machine
from rtctl.machines.profile import REELS, SCALE
from rtctl.machines.profiles import profile_of
from rtctl.machines.wiring import TERMINALS, wiring
from rtctl.plants.fmu import Fmu

Sensor = Callable[[float], None]


class FmuPlant:
    """An FMU that serves a loop. Raises UserError where the FMU does not fit the machine."""

    def __init__(self, machine: Machine, link: str, status: Any, out: Any, inp: Any) -> None:
        config = machine.config
        terminals = TERMINALS[config.kind]
        self.fmu = Fmu(config.plant.fmu, terminals.drives, terminals.sensors, machine.dt)
        dither = getattr(getattr(config, "board", None), "dither", False)
        self.card = EmulatedCard(wiring(config), EmulatedBoard(dt=machine.dt, seed=config.loop.seed), dither)
        self.card.open()
        self._encoders: list[Any] = []
        self._sensors = self._wired(config, machine.dt)
        self.end = LinkEnd(link, status, out, inp)
        self._status = status
        self._show()

    def _wired(self, config: Any, dt: float) -> list[Sensor]:
        """Functions that apply each reading of the FMU to the board, in the order of the machine's sensors."""
        profile = profile_of(config.kind)
        if profile.has(REELS):
            reels = ((config.sensors.reel1, config.board.reel1), (config.sensors.reel2, config.board.reel2))
            return [self._rotary(0, config.sensors.capstan, dt), *(self._optical(s, w.channel, dt) for s, w in reels)]
        if profile.has(SCALE):
            return [self._rotary(0, config.sensors.encoder, dt), self._linear(1, config.sensors.scale, dt)]
        return [self._linear(0, config.encoder, dt)]

    def _rotary(self, counter: int, settings: Any, dt: float) -> Sensor:
        p, s = ls7084.build(settings, dt), np.zeros(1, ls7084.LS7084_STATE)[0]
        self._encoders.append(s)
        return lambda theta: self._pulse(counter, ls7084.step(p, s, theta, dt))

    def _linear(self, counter: int, settings: Any, dt: float) -> Sensor:
        p, s = linear_scale.build(settings, dt), np.zeros(1, linear_scale.LINEAR_SCALE_STATE)[0]
        return lambda x: self._pulse(counter, linear_scale.step(p, s, x))

    def _optical(self, settings: Any, channel: int, dt: float) -> Sensor:
        p = optical_sensor.build(settings, dt)

        def show(theta: float) -> None:
            self.card.card.input_volts[channel] = optical_sensor.volts(p, theta)

        return show

    def _pulse(self, counter: int, pulses: int) -> None:
        self.card.card.dio[daq_stc.DIO_LINE[counter]] = int(pulses > 0)
        self.card.card.pulse(counter, abs(pulses))

    def _show(self) -> None:
        for sensor, reading in zip(self._sensors, self.fmu.readings, strict=True):
            sensor(reading)

    def advance(self) -> None:
        """Advance the FMU by one tick with the outputs of the newest frame."""
        tx, wires = self.end.tx, self.card.wiring
        self.card.write([int(c) for c in tx["ao_codes"][: len(wires.outputs)]], int(tx["dio_lines"]))
        volts = [self.card.card.output_volts(o.channel) for o in wires.outputs]
        if wires.lines:  # the LDU's amplifier takes a voltage and a direction bit
            volts = [v if self.card.card.dio[wires.lines[0]] else -v for v in volts]
        self.fmu.tick(volts)
        self._show()

    def run(self) -> None:
        """Send a sample, receive outputs and advance by one tick, until status.stop is set."""
        try:
            while not self.end.stopped:
                self.card.read(self.end.rx)
                self.end.rx["lost_counts"] = sum(int(s["lost"]) for s in self._encoders)
                self.end.answer()
                while not self.end.wait():
                    if self.end.stopped:
                        return
                self.advance()
        finally:
            self.fmu.close()
            self._status["ended"][0] = 1
