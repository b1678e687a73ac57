"""Which channels of a board each machine uses, and what its drives and sensors are called there.

The order is that of the codes in the link's frame, and the same for an emulated board, a real one and an FMU.
"""

from typing import Any, NamedTuple

from rtctl.drivers.board import Wiring


class Terminal(NamedTuple):
    """A quantity at the board's connector: what a plant gets or gives there."""

    name: str  # as the nodes of the plant's physics are called
    unit: str
    help: str


class Terminals(NamedTuple):
    drives: tuple[Terminal, ...]  # in the order of the frame's output codes
    sensors: tuple[Terminal, ...]  # counters first, then analog inputs


TERMINALS: dict[str, Terminals] = {
    "ivu": Terminals(
        (
            Terminal("drive1", "V", "at the driver of motor 1, -10 to 10 V, 0.2 A/V"),
            Terminal("drive2", "V", "at the driver of motor 2, -10 to 10 V, 0.2 A/V"),
        ),
        (
            Terminal("encoder", "rad", "angle of the capstan"),
            Terminal("reel1", "rad", "angle of reel 1"),
            Terminal("reel2", "rad", "angle of reel 2"),
        ),
    ),
    "ldu": Terminals(
        (Terminal("drive", "V", "at the amplifier, signed by the direction bit"),),
        (
            Terminal("encoder", "rad", "angle of the capstan's motor encoder"),
            Terminal("scale", "m", "position of the carriage"),
        ),
    ),
    "axis": Terminals(
        (Terminal("drive", "V", "at the drive"),),
        (Terminal("sensor", "m", "position"),),
    ),
}


def wiring(config: Any) -> Wiring:
    """Channels that a machine's config uses."""
    if config.kind == "ivu":
        board = config.board
        return Wiring((board.output1, board.output2), (board.reel1, board.reel2), counters=1)
    if config.kind == "ldu":
        return Wiring((config.board.output,), (), counters=2, lines=(config.board.direction_line,))
    return Wiring((config.output,), (), counters=1)
