"""A card beneath the official nidaqmx package, for tests: its lowest layer, which would call NI-DAQmx, with wires.

The package's own tasks, channels, readers and writers run; only what goes into the C library ends here.
"""

from typing import Any

import numpy as np
from nidaqmx._base_interpreter import BaseInterpreter
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError

STEP = 20 / 65536  # V, a 16-bit converter over -10 to 10 V


class Daqmx(BaseInterpreter):
    """Dev1, a card with 16 inputs, 2 outputs, 2 counters and 8 lines."""

    def __init__(self) -> None:
        self.devices = ["Dev1"]
        self.tasks: dict[int, dict[str, Any]] = {}
        self.volts = [0.0] * 16
        self.out = [3.21, 3.21]
        self.lines = 0xFF
        self.counts = [0, 0]
        self.fails = ""
        self.timed: float | None = None

    # wires

    def pulses(self, n: int, pulses: int) -> None:
        """Edges at the encoder of a counter whose task runs."""
        for task in self.tasks.values():
            if task["kind"] == "counter" and task["channels"] == [n] and task["started"]:
                self.counts[n] = (self.counts[n] + pulses) % (1 << 32)

    def _may(self, what: str) -> None:
        if self.fails == what:
            raise DaqError("Measurement or Generation: the device is not present.\n\nDevice: Dev1", -88709)

    # tasks

    def create_task(self, session_name: str) -> tuple[Any, bool]:
        handle = len(self.tasks) + 1
        self.tasks[handle] = {"kind": "", "channels": [], "started": False, "open": True}
        return handle, True

    def start_task(self, task: int) -> None:
        self.tasks[task]["started"] = True

    def clear_task(self, task: int) -> None:
        self.tasks[task].update(open=False, started=False)

    def get_task_attribute_string(self, task: int, attribute: int) -> str:
        return f"task{task}"

    def internal_get_last_created_chan(self) -> str:
        return "chan"

    def _add(self, task: int, kind: str, name: str, low: float = 0.0, high: float = 0.0) -> None:
        if not name.startswith("Dev1/"):
            raise DaqError("Device identifier is invalid.", DAQmxErrors.INVALID_DEVICE_ID)
        if abs(low) > 10.0 or high > 10.0:
            raise DaqError("Requested value is not a supported value for this property.\n\nProperty: AI.Max", -200077)
        number = int("".join(c for c in name.rpartition("/")[2] if c.isdigit()))
        self.tasks[task]["kind"] = kind
        self.tasks[task]["channels"].append(number)

    def create_ai_voltage_chan(self, task, physical, name, terminal, low, high, units, scale):  # type: ignore[no-untyped-def]
        self._add(task, "input", physical, low, high)

    def create_ao_voltage_chan(self, task, physical, name, low, high, units, scale):  # type: ignore[no-untyped-def]
        self._add(task, "output", physical, low, high)

    def create_do_chan(self, task, lines, name, grouping):  # type: ignore[no-untyped-def]
        for line in lines.split(","):
            self._add(task, "lines", line)

    def create_ci_ang_encoder_chan(  # type: ignore[no-untyped-def]
        self, task, counter, name, decoding, z, z_value, z_phase, units, pulses, initial, scale
    ):
        assert (decoding, units) == (10092, 10304)  # X4, ticks
        self._add(task, "counter", counter)
        self.counts[self.tasks[task]["channels"][0]] = int(initial)

    def create_ci_count_edges_chan(self, task, counter, name, edge, initial, direction):  # type: ignore[no-untyped-def]
        assert direction == 10326  # by a digital line
        self._add(task, "counter", counter)
        self.counts[self.tasks[task]["channels"][0]] = initial

    def cfg_samp_clk_timing(self, task, rate, source, edge, mode, samples):  # type: ignore[no-untyped-def]
        assert mode == 12522  # hardware-timed single point
        self.timed = rate

    # data

    def read_analog_f64(self, task, samples, timeout, fill, into):  # type: ignore[no-untyped-def]
        self._may("inputs")
        values = [self.volts[c] for c in self.tasks[task]["channels"]]
        into[:] = np.clip(np.rint(np.array(values) / STEP) * STEP, -10, 10 - STEP)
        return into, samples

    def read_counter_scalar_u32(self, task, timeout):  # type: ignore[no-untyped-def]
        self._may("counters")
        return self.counts[self.tasks[task]["channels"][0]]

    def read_counter_scalar_f64(self, task, timeout):  # type: ignore[no-untyped-def]
        return float(self.read_counter_scalar_u32(task, timeout))

    def write_analog_f64(self, task, samples, auto_start, timeout, fill, values):  # type: ignore[no-untyped-def]
        self._may("outputs")
        for channel, value in zip(self.tasks[task]["channels"], values, strict=True):
            self.out[channel] = float(value)
        return 1

    def write_digital_scalar_u32(self, task, auto_start, timeout, value):  # type: ignore[no-untyped-def]
        self._may("lines")
        mask = sum(1 << line for line in self.tasks[task]["channels"])
        self.lines = (self.lines & ~mask) | (value & mask)

    # what the system and the card say of themselves

    def get_system_info_attribute_string(self, attribute: int) -> str:
        return ", ".join(self.devices)

    def get_device_attribute_string(self, device: str, attribute: int) -> str:
        return {
            0x0631: "PCIe-6321",
            0x231E: ", ".join(f"Dev1/ai{n}" for n in range(16)),
            0x231F: "Dev1/ao0, Dev1/ao1",
            0x2324: "Dev1/ctr0, Dev1/ctr1",
        }[attribute]


Daqmx.__abstractmethods__ = frozenset()  # type: ignore[attr-defined]
