"""Settings that all machines share, and the block diagram from which a tick is generated."""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from rtctl.drivers.board import EmulatedSettings
from rtctl.drivers.boards import DriverSettings
from rtctl.idiom import Settings, quantity
from rtctl.tick.faults import FaultSettings
from rtctl.tick.safety import SafetySettings

DESCRIBED = "described"  # kind of a machine whose config holds its description


class Column(NamedTuple):
    """One signal of the trace."""

    name: str
    unit: str
    help: str


class Block(NamedTuple):
    """One block of the diagram: its name in `p` and `s`, its params (None for none) and its state (None for none)."""

    name: str
    params: Any
    state: np.dtype | None


class Diagram(NamedTuple):
    """Block diagram of a machine's tick: modules, blocks, recorded columns, and lines by named stage, in order."""

    uses: tuple[str, ...]  # modules, e.g. "rtctl.laws.pd"
    blocks: tuple[Block, ...]
    columns: tuple[Column, ...]
    stages: tuple[tuple[str, tuple[str, ...]], ...]


class PlantDiagram(NamedTuple):
    """An emulated machine: lines that start it, that advance it by one period, and that sample its sensors."""

    uses: tuple[str, ...]
    blocks: tuple[Block, ...]
    truth: tuple[Column, ...]  # true signals of the emulator, in the order of the frame's truth
    start: tuple[str, ...]
    advance: tuple[tuple[str, tuple[str, ...]], ...]
    sample: tuple[tuple[str, tuple[str, ...]], ...]


class Signals(NamedTuple):
    """Columns by which a run is judged."""

    position: str  # measured signal that follows the reference
    error: str
    outputs: tuple[str, ...]  # to the drives
    truth: str  # the position in the emulator


class LinkSettings(Settings):
    """Link between the loop and its plant or board."""

    kind: Literal["zmq", "shm"] = Field(default="zmq", description="ZeroMQ (also across machines) or shared memory")
    endpoint: str | None = Field(
        default=None, description="where the plant listens, e.g. tcp://bench2:5570; a local socket if absent"
    )
    plant: Literal["spawn", "external"] | None = Field(
        default=None,
        description="spawn: start the emulator with the loop; external: somebody else runs `rtctl plant`; if absent, "
        "external where an endpoint is given",
    )
    timeout: float = quantity(5.0, unit="s", gt=0, help="how long to wait for the plant at the start and in lockstep")
    keys: str | None = Field(default=None, description="name of the CURVE keys, needed for anything but this machine")

    @property
    def spawns(self) -> bool:
        """Whether the plant is started with the loop."""
        return self.plant == "spawn" or (self.plant is None and self.endpoint is None)


class LoopSettings(Settings):
    """Rate, clock and scheduling of the loop."""

    rate: float = quantity(unit="Hz", gt=0.1, le=50e3, help="ticks a second")
    mode: Literal["real", "lockstep", "fused"] = Field(
        default="real", description="real: wall clock; lockstep: virtual time, two processes; fused: virtual, in one"
    )
    write: Literal["next_tick", "same_tick"] = Field(
        default="next_tick",
        description="next_tick: outputs leave at the start of the next tick, with a constant delay of one period; "
        "same_tick: they leave as soon as they are computed",
    )
    realtime: Literal["required", "preferred", "off"] = Field(
        default="preferred", description="required: refuse to start without SCHED_FIFO and locked memory"
    )
    priority: int = Field(default=80, ge=1, le=99, description="SCHED_FIFO priority of the loop's thread")
    cpu: int | None = Field(default=None, ge=0, description="CPU of the loop; the last one if absent")
    spin: float = quantity(0.0, unit="s", ge=0, le=1e-3, help="end of each sleep that is spent polling the clock")
    late: float = Field(default=0.5, gt=0, le=1, description="share of a period beyond which a tick counts as late")
    seed: int = Field(default=1, ge=0, description="seed of dither and noise in the emulated board")


class RecordSettings(Settings):
    """Recorded signals, and how they are written to disk."""

    seconds: float = quantity(20.0, unit="s", gt=0, help="length of the ring between loop and supervisor")
    batch: float = quantity(0.1, unit="s", gt=0, le=10, help="longest time until a row is on disk")
    rotate_mb: float | None = Field(
        default=None, gt=0, description="MB of rows, before compression, that fill a part of a long recording"
    )
    rotate_minutes: float | None = Field(
        default=None, gt=0, description="minutes that fill a part; one part without either"
    )
    truth: bool = Field(default=True, description="record the true signals of the emulator beside the sensors")
    trace: list[str] = Field(default=[], description="state fields to record besides, e.g. position.d")


class CommandSettings(Settings):
    """Sockets for commands and telemetry."""

    endpoint: str | None = Field(default=None, description="command socket; a local socket if absent")
    telemetry: str | None = Field(default=None, description="telemetry socket; a local socket if absent")
    telemetry_period: float = quantity(0.02, unit="s", ge=0.01, le=1, help="time between telemetry messages")
    telemetry_rate: float = quantity(1000.0, unit="Hz", gt=0, help="most rows a second in the telemetry")
    keys: str | None = Field(default=None, description="name of the CURVE keys, needed for anything but this machine")


class MetricsSettings(Settings):
    """Metrics for Prometheus."""

    port: int | None = Field(
        default=None, ge=1, le=65535, description="port for Prometheus, on 127.0.0.1 only; none if absent"
    )


class MachineSettings(Settings):
    """Keys that every machine's config has."""

    name: str = Field(pattern=r"^[A-Za-z0-9_-]{1,40}$", description="name of this machine; one daemon a name")
    loop: LoopSettings
    link: LinkSettings = LinkSettings()
    driver: DriverSettings = Field(
        default=EmulatedSettings(), description="the board: emulated with the machine, or a real card"
    )
    safety: SafetySettings = SafetySettings()
    record: RecordSettings = RecordSettings()
    commands: CommandSettings = CommandSettings()
    metrics: MetricsSettings = MetricsSettings()
    faults: list[FaultSettings] = Field(default=[], description="faults to inject; `rtctl fault list` explains them")
    live: dict[str, Any] = Field(
        default={}, description="bounds of changes while the machine runs, wider than the values above: path: value"
    )
    own: dict[str, str] = Field(
        default={}, description="texts of the own files that the config names; filled in when it is read, and recorded"
    )

    @property
    def kind(self) -> str:
        """Name of the kind of machine; `described` where the config holds a description."""
        machine = getattr(self, "machine")  # noqa: B009  a field of the subclasses
        return machine if isinstance(machine, str) else DESCRIBED


COMMON_COLUMNS = (
    Column("tick", "", "number of the tick"),
    Column("t", "s", "controller clock at the tick"),
    Column("period", "s", "measured time since the tick before"),
    Column("lateness", "s", "how late the tick woke"),
    Column("state", "", "0 idle, 1 armed, 2 running, 3 tripped"),
    Column("trip", "", "cause of the trip, 0 for none"),
    Column("link_age", "ticks", "periods since plant or board last sent a frame"),
    Column("order", "", "number of the newest order that the tick had taken in; see orders.jsonl"),
    Column("watchdog", "", "times that the board has taken its outputs to zero by itself"),
)
STATE_LINES = (
    "safety.command(s.safety, c, passed)",
    "safety.check_timing(p.safety, s.safety, c, fresh, late, gone, y.watchdog, k)",
)
TRACE_LINES = (
    "y.state = s.safety.state",
    "y.trip = s.safety.trip",
    "y.link_age = s.safety.silent",
    "y.order = c.order",
)


class PhysicsLines(NamedTuple):
    """Modules, blocks and lines of the terms in a plant's `physics:` list."""

    uses: tuple[str, ...]
    blocks: tuple[Block, ...]
    command: tuple[str, ...]  # lines by site, see plants/physics/term.py
    force: tuple[str, ...]
    reading: tuple[str, ...]
    moves: tuple[str, ...]  # those of the reading lines that give the carriage's position


class RatioParams(NamedTuple):
    ratio: float  # motion of a node for one unit of its coordinate


def physics_lines(
    terms: list[Any],
    kind: str,
    dt: float,
    place_of: Callable[[str], Any] | None = None,
    record: str = "s.plant.m",
    prefix: str = "term",
) -> PhysicsLines:
    """Modules, blocks and lines of the plant's terms, in the order in which they act.

    `place_of` gives the place of an entry on a described machine (plants/graph/elements.py); by `kind` where absent.
    `record` is the machine's record; the names of the blocks begin with `prefix`.
    """
    from rtctl.plants.physics import TERMS, ordered, place
    from rtctl.plants.physics.term import SITES

    blocks: list[Block] = []
    uses: list[str] = []
    lines: dict[str, list[str]] = {site: [] for site in SITES}
    moves: list[str] = []
    for number, settings in enumerate(ordered(terms)):
        term = TERMS[settings.term]
        name = f"{prefix}{number}"
        if place_of is None:
            spot = place(kind, settings.node)
            ratio = f"p.plant.{spot.factor}" if spot.factor else "1.0"
        else:
            spot, ratio = place_of(settings), f"p.{name}_node.ratio"
            blocks.append(Block(f"{name}_node", RatioParams(spot.factor), None))
        blocks.append(Block(name, term.build(settings, dt), term.state))
        uses.append(term.build.__module__)
        for site in SITES:
            act = term.act_at(site, kind)
            if act is not None:
                line = act.format(
                    p=f"p.{name}", s=f"s.{name}", m=record, i=spot.node, l=spot.link, c=spot.channel,
                    k=getattr(spot, "other", -1), r=ratio,
                )  # fmt: skip
                lines[site] += line.split("\n")
                if site == "reading" and term.moves:
                    moves += line.split("\n")
    force = (*lines["force"], *lines["last"])
    return PhysicsLines(
        tuple(dict.fromkeys(uses)),
        tuple(blocks),
        tuple(lines["command"]),
        force,
        tuple(lines["reading"]),
        tuple(moves),
    )
