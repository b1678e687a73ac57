"""Emulated machines with mechanics in a user's file, and the board, counters and sensors around the mechanics."""

from typing import Any, NamedTuple

from rtctl.machines.base import Block, PlantDiagram
from rtctl.machines.profiles import profile_of
from rtctl.own.parts import Parts
from rtctl.own.plant import own_plants
from rtctl.plants.shown import Own


class StepParams(NamedTuple):
    h: float  # s, of a substep


def is_own(config: Any) -> bool:
    """Whether the plant of a config is a user's file."""
    return type(config.plant) in own_plants


def plant_diagram(config: Any, period: float, seed: int, substeps: int) -> PlantDiagram:
    """Blocks and lines of the emulated machine, advanced by `period` s a call."""
    profile, h = profile_of(config.kind), period / substeps
    assert profile.own is not None
    own: Own = profile.plant.OWN
    parts = own_plants[type(config.plant)]
    blocks, read, write, sample = profile.own(config, h, seed)
    fields = parts.state.names or ()
    truth = (f"s.own.{name}" if name in fields else "np.nan" for name in own.truth)
    used = [line for lines in (read, write, sample) for line in lines]
    step = parts.call("step", "own", own.inputs)
    return PlantDiagram(
        uses=(parts.module.__name__, *(m for m in DRIVERS if any(m.rpartition(".")[2] in u for u in [*used, step]))),
        blocks=(Block("plant", StepParams(h), None), Block("own", parts.build(config.plant, h), parts.state), *blocks),
        truth=profile.truth,
        start=(parts.call("start", "own", {}),),
        advance=(("drives", read), ("physics", (step,)), ("encoders", write)),
        sample=(("scan", sample), ("truth", tuple(f"rx.truth[{i}] = {value}" for i, value in enumerate(truth)))),
    )


def parts_of(config: Any) -> Parts | None:
    """Parts of a user's plant; None for a plant of rtctl."""
    return own_plants.get(type(config.plant))


DRIVERS = tuple(
    f"rtctl.drivers.{name}"
    for name in ("at_mio_16de", "daq_stc", "ldu_amplifier", "linear_scale", "ls7084", "optical_sensor")
)
