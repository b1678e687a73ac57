"""Profile of a kind of machine for experiments, designs, tests and reports: traits, columns, usual sizes and models.

Each machine declares one `Profile` (ivu_profile.py, ldu_profile.py, axis_profile.py). Other modules ask the profile;
none compares with the name of a machine (tests/test_names.py).
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from rtctl.drivers.board import Wiring
from rtctl.machines.base import Block, Column
from rtctl.machines.duty import Duty
from rtctl.machines.exchange import Exchange

REELS = "reels"  # a motor at either end winds tape on a reel; the tape turns a capstan with an encoder
SCALE = "scale"  # a carriage has a linear scale beside the encoder of its drive
AMPLIFIER = "amplifier"  # a current amplifier takes a voltage and a direction bit, up to `amplifier.limit`
FREE_UNITS = "free units"  # of a recording: position, speed and command may have other units than m, m/s and V
NOTHING: Mapping[str, Any] = MappingProxyType({})
Lines = tuple[str, ...]


class Terminal(NamedTuple):
    """Quantity at the board's connector: input or output of a plant."""

    name: str  # name of the node in the plant's physics
    unit: str
    help: str


class Terminals(NamedTuple):
    drives: tuple[Terminal, ...]  # in the order of the frame's output codes
    sensors: tuple[Terminal, ...]  # counters first, then analog inputs


class Columns(NamedTuple):
    """Columns with one meaning on all machines."""

    position: str
    command: str  # V, after excitation and friction compensation, before limits
    written: tuple[str, ...]  # V, to the drives
    speed: str  # filtered, rad/s or m/s; "" where it is not recorded


class Model(NamedTuple):
    """A plant from the command (V) to the measured position, x' = A x + b u, y = c x."""

    A: np.ndarray  # (n, n)
    b: np.ndarray  # (n,)
    c: np.ndarray  # (n,) m or rad


class Usual(NamedTuple):
    """Default excitation of a frequency response."""

    speed: float  # rad/s or m/s
    rms: float  # V, multisine
    noise_rms: float  # V
    band: tuple[float, float]  # Hz, multisine
    noise_top: float  # Hz
    settle: float  # s, from a turn of the reference to constant speed
    law: dict[str, Any]  # keys of the config
    most: float | None = None  # V, linear range of the drive; that of the amplifier if absent


class Response(NamedTuple):
    """Experiment and fit of the machine's frequency response."""

    usual: Usual
    free: tuple[str, ...]  # parameters that are fitted by default
    band: tuple[float, float]  # Hz, of the fit
    drive: Callable[[Any, np.ndarray], np.ndarray]  # config, f (n,) Hz -> (n,) A/V
    params: Callable[[Any, float, float], Any]  # plant settings, radii R1 and R2 in m -> params of the plant
    each: tuple[str, ...] = ()  # parameters of both sides, which responses of both motors tell apart


class Friction(NamedTuple):
    """Experiment for the machine's dry friction."""

    speeds: tuple[float, ...]  # rad/s of the capstan
    unit: str  # of the force
    per_rad: Callable[[Any], float]  # config -> motion of the reference for a radian of the capstan
    gain: float  # V for one unit of position, of the law in the break-away test
    most: float  # V
    rate: float  # V/s
    running: dict[str, Any]  # keys of the config at constant velocity
    soft: dict[str, Any]  # keys of the config in the break-away test


class Range(NamedTuple):
    """Limits of a soak's random day. Lengths in the unit of the machine's reference (rad or m), times in s."""

    position: str  # column
    error: str
    outputs: tuple[str, ...]
    counts: str
    truth: str  # true position of the counted body, in an emulator only
    tensions: tuple[str, ...]  # estimates
    truth_tensions: tuple[str, ...]
    travel: float  # to either side of the initial position
    jump: float  # largest setpoint without a ramp
    rate: tuple[float, float]  # of a ramp, per s
    settle: float  # from the end of a move to the check of its target
    tolerance: float  # largest distance from the target at the check
    stretch: float  # counts, largest difference of encoder and truth: an edge just passed, springs between the two
    counters: int  # channels that are wired
    inputs: int
    gains: dict[str, tuple[float, float]]  # setting -> share of the config's own value, lowest and highest
    measure: tuple[str, str] | None = None  # setting with which arming measures a quantity that counts then track
    knots: tuple[tuple[float, float], ...] = ()  # (s, rad or m) from the start, for a config without reference


class OwnBlocks(NamedTuple):
    """Board and sensors around a plant in a user's file."""

    blocks: tuple[Block, ...]
    read: Lines  # lines by which commands come in
    write: Lines  # lines by which sensors are counted, each substep
    sample: Lines  # lines of the frame


class Profile(NamedTuple):
    """Profile of a kind of machine; a described machine has the defaults."""

    kind: str = ""
    title: str = ""
    unit: str = ""  # of position: rad or m
    traits: frozenset[str] = frozenset()
    plant: Any = None  # module of plants/ with equations and parameters
    truth: tuple[Column, ...] = ()
    columns: Columns = Columns("", "", (), "")
    error: str = "position_error"
    still: float = 0.0  # rad or m, least settling band of a step
    pairs: Mapping[str, tuple[str, str]] = NOTHING  # name -> parameters of both sides, where they are alike
    encoder: Callable[[Any], Any] | None = None  # config -> settings of the rotary encoder on the capstan
    model: Callable[[Any, Any, dict[str, Any], int], Model] | None = None  # config, plant's params, blocks, motor
    response: Response | None = None
    friction: Friction | None = None
    bandwidth: float = 0.0  # Hz, usual of a tuned loop: w_n of a PD, or -3 dB of the closed loop
    least: tuple[float, float] = (6.0, 45.0)  # dB and deg, usual margins
    frictionless: Mapping[str, float] = NOTHING  # keys of the config that remove dry friction
    alone: Mapping[str, Any] = NOTHING  # keys of the config with which one motor controls the position
    feedforward: tuple[str, ...] = ()  # keys of the config that feed forward; 0 switches each off
    range: Range | None = None
    output: Callable[[Any], Any] | None = None  # config -> settings of the first converter of outputs
    counts: Callable[[Any], float] | None = None  # config -> counts for one unit of the truth column
    terminals: Terminals = Terminals((), ())
    wiring: Callable[[Any], Wiring] | None = None
    own: Callable[[Any, float, int], OwnBlocks] | None = None  # config, substep in s, seed
    case: Callable[[Any], dict[str, Any]] | None = None  # config -> keys of case.json
    exchange: Exchange | None = None  # of recordings of exchange format 1
    duty: Duty | None = None  # nominal duty

    def has(self, trait: str) -> bool:
        """Whether the machine has a trait."""
        return trait in self.traits
