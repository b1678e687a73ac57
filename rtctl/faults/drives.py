"""Two drivers of a run, exact to the tick: in this process, and as the processes of the daemon.

Both stop before a given tick, so that an order reaches the loop at this tick.
"""

import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rtctl import machines
from rtctl.daemon.plant_process import Plant
from rtctl.daemon.supervisor import Supervisor
from rtctl.loop import fused, generate
from rtctl.loop.loop import Loop
from rtctl.loop.mailbox import Mailbox
from rtctl.trace.bundle import load_bundle

Write = Callable[[Any, Any], None]
PATIENCE = 300.0  # s, time limit of a part of a run on a busy computer


def again(_: Any, command: Any) -> None:
    """Reset, arm and play."""
    for name in ("reset", "arm", "play"):
        command[name] += 1


class Inside:
    """Loop and emulator in this process, `fused` or in turns between two threads (`lockstep`)."""

    def __init__(self, config: Any, ticks: int):
        machine = machines.build(config)
        made = generate.generate(machine, "shm")
        self._segment = fused.segment(made, ticks + 1)
        self._plant: threading.Thread | None = None
        generate.prepare(self._segment, machine)
        self.post = Mailbox(self._segment).post
        self.post(again)
        self._loop = Loop(machine, made, self._segment, self._segment["outputs"], self._segment["inputs"])
        self._lockstep = config.loop.mode == "lockstep"

    def __enter__(self) -> "Inside":
        if self._lockstep:
            plant = Plant(*self._plant_arguments())
            self._loop.warm()  # compile before the start: the emulator waits at most five seconds
            self._plant = threading.Thread(target=plant.run)
            self._plant.start()
        return self

    def _plant_arguments(self) -> tuple[Any, ...]:
        s = self._segment
        return self._loop.machine, self._loop.made, s["plant_status"], s["inputs"], s["outputs"]

    def __exit__(self, *_: Any) -> None:
        if self._plant is not None:
            self._segment["plant_status"]["stop"] = 1
            self.to(self._tick + 1)  # the emulator waits for outputs
            self._plant.join()

    @property
    def _tick(self) -> int:
        return int(self._segment["status"][0]["tick"])

    def to(self, tick: int) -> None:
        """Run until the next tick is `tick`."""
        self._loop.stretch(self._tick, tick - self._tick)

    def wire(self) -> list[int]:
        """DAC codes at the outputs of the machine."""
        return self._loop.held[0]["ao_codes"].tolist()

    def rows(self) -> Any:
        """Rows up to now, by column."""
        return self._segment["rows"][: self._tick]


class _Held(Supervisor):
    """Supervisor whose loop waits before tick 1 for a tick to run to."""

    def _start_children(self, stack: ExitStack, rows: int) -> None:
        self.status["hold"] = 1
        super()._start_children(stack, rows)


class Processes:
    """Supervisor, loop and emulator as processes of `rtctl run`; `out` is the folder of the recording."""

    def __init__(self, config: Any, ticks: int, out: Path):
        self._supervisor = _Held(config, out, ticks)
        self._supervisor.armed_at_start = True
        self._out = out

    def __enter__(self) -> "Processes":
        self._supervisor.__enter__()
        return self

    def __exit__(self, *_: Any) -> None:
        self._supervisor.__exit__()

    def post(self, write: Write) -> None:
        self._supervisor.order(write)

    def to(self, tick: int) -> None:
        """Run until the next tick is `tick`."""
        status, deadline = self._supervisor.status, time.monotonic() + PATIENCE
        status["hold"] = tick
        while int(status["tick"]) < tick:
            if not self._supervisor.turn():
                raise self._supervisor.failure or RuntimeError(f"the loop ended at tick {int(status['tick'])}")
            if time.monotonic() > deadline:
                raise TimeoutError(f"the loop stopped at tick {int(status['tick'])} before tick {tick}")
            time.sleep(0.001)

    def wire(self) -> list[int]:
        """DAC codes at the outputs of the machine."""
        return self._supervisor.segment["outputs"][0]["frame"]["ao_codes"].tolist()

    def rows(self) -> Any:
        """Rows of the recording, by column; ends the run."""
        self._supervisor.stop()
        self._supervisor.finish()
        return load_bundle(self._out).columns
