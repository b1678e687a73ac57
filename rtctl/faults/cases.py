"""Catalogue of faults by shipped machine, with begin, duration and size of each fault."""

from typing import Any, NamedTuple

from rtctl import machines
from rtctl.config.load import load_settings, set_paths
from rtctl.config.yaml_file import find


class Case(NamedTuple):
    """One fault of the catalogue."""

    fault: str
    channel: int = 0
    size: float | None = None  # None: usual size of the fault

    @property
    def title(self) -> str:
        return f"{self.fault} {self.channel}" if self.channel else self.fault


class Stand(NamedTuple):
    """Shipped machine with a motion. Times in s from the first tick, which arms and plays."""

    name: str
    reference: dict[str, Any]
    begin: float  # begin of the fault, in the middle of a motion at constant speed
    lasts: float  # duration of the fault, longer than the time to any trip
    again: float  # time of reset, arm and play, after the fault
    last: float  # end of the run, after a further motion
    move: float  # least travel of the further motion, rad or m
    outputs: tuple[str, ...]  # columns of the outputs
    error: str  # column of the following error
    cases: tuple[Case, ...]

    def ticks(self, seconds: float) -> int:
        return round(seconds * self.config().loop.rate)

    def config(self, faults: list[dict[str, Any]] | None = None, **changes: Any) -> Any:
        """Shipped config with the motion and these faults; `changes` have __ for the dots of a path."""
        made = load_settings(find(self.name), machines.CONFIGS[self.name])
        values = {name.replace("__", "."): value for name, value in changes.items()}
        return set_paths(made, {"reference": self.reference, "faults": faults or [], "link.kind": "shm", **values})

    def fault(self, case: Case) -> dict[str, Any]:
        """Entry of the case in `faults:`."""
        entry = {"fault": case.fault, "at": self.begin, "lasts": self.lasts, "channel": case.channel}
        return entry if case.size is None else {**entry, "size": case.size}


COMMON = (
    Case("link.loss", size=0.5),
    Case("link.reorder", size=0.5),
    Case("link.silent"),
    Case("encoder.freeze"),
    Case("encoder.missed", size=0.3),
    Case("encoder.noise", size=200.0),
    Case("adc.open"),
    Case("dac.stuck", size=9.0),
    Case("driver.hot"),
    Case("supply.sag"),
    Case("loop.stall", size=3e-3),
)
EVERY = (
    Stand(
        name="ivu",
        reference={"steps": [{"at": 0.2, "to": 6.0, "ramp": 1.5}]},
        begin=2.0,
        lasts=1.5,
        again=3.6,
        last=5.2,
        move=0.5,
        outputs=("u1", "u2"),
        error="capstan_error",
        cases=(Case("link.delay", size=0.1), *COMMON),
    ),
    Stand(
        name="ldu",
        reference={"steps": [{"at": 0.1, "to": 0.06, "ramp": 0.03}]},
        begin=0.5,
        lasts=1.2,
        again=1.8,
        last=2.4,
        move=0.005,
        outputs=("u",),
        error="position_error",
        cases=(Case("link.delay", size=0.02), *COMMON, Case("encoder.freeze", channel=1)),
    ),
)
STANDS = {stand.name: stand for stand in EVERY}
