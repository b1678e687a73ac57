"""The Linear Drive Unit: a motor shaft rolls on a transmission wheel, whose capstan rolls along a steel strip.

    K_m1 I = K_m2 th_m' + J_m th_m'' + b_s (th_m' - N th_t') + k_s (th_m - N th_t)                       (F.1-F.3, F.8)
    N [b_s (th_m' - N th_t') + k_s (th_m - N th_t)] = J_t th_t'' + b_c (th_t' - th_c') + k_c (th_t - th_c)         (F.4)
    b_c (th_t' - th_c') + k_c (th_t - th_c) = (J_c + M R_c^2) th_c'' + (B_c + R_c^2 B_m) th_c'
                                              + b_c (th_c' - th_e') + k_c (th_c - th_e) + R_c F_c     (F.5, F.6, F.9)
    b_c (th_c' - th_e') + k_c (th_c - th_e) = J_e th_e''                                                         (F.7)

The machine runs by its description ldu.yaml, by the kernel of all machines. The position of the carriage is
x = R_c th_c. F_c is the dry friction of the carriage, which the thesis finds (12.6) but omits from its equations.

Source: thesis 12.1 and appendix F. Erratum: `b_m` in row 4 of A is b_s; the ninth column of A does not exist.
The listed k_s, k_c give 239, 919, 951 and 3261 Hz; figure 12.2 shows 114, 254, 286 and 2100 Hz, hence two sets.
Damping, B_c, B_m, K_m2 are not given; they are chosen for 2 to 10 percent modal damping. F_c follows by (12.3) from
the break-away voltages of 12.6.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings, quantity
from rtctl.plants.element import LOOP, element
from rtctl.plants.graph import plant
from rtctl.plants.graph.params import GraphParams
from rtctl.plants.graph.plant import GRAPH_STATE
from rtctl.plants.graph.symbols import Machine, machine
from rtctl.plants.shown import Own, Shown

MOTOR, WHEEL, CAPSTAN, ENCODER = range(4)
NODES = {"motor": MOTOR, "wheel": WHEEL, "capstan": CAPSTAN, "encoder": ENCODER}
LINKS = {
    "motor": 0,
    "wheel": 0,
    "capstan": 1,
    "encoder": 2,
}  # the shaft between motor and wheel, the two halves of the capstan
DRIVES = {"drive": 0}
RUBS = {"drive": CAPSTAN}  # coordinate of the dry friction on which a drive acts
SENSORS = {"encoder": 0, "scale": 1}
ELEMENTS = (
    element("motor", "body", "turns driven"),
    element("wheel", "body", "turns load wheel rotor loaded"),
    element("capstan", "body", "turns load capstan rotor loaded"),
    element("carriage", "body", "slides load dry rubs bounded guided"),
    element("motor", "joint", "shaft"),  # the spring of the wheel by its other end
    element("wheel", "joint", "spring shaft contact"),
    element("capstan", "joint", "spring shaft contact rigid"),  # its two halves are springs, the strip's contact none
    element("drive", "drive", "current supply"),
    element("encoder", "sensor", "position counts turns load feedback"),
    element("scale", "sensor", "position counts slides load guided"),
    LOOP,
)
NY, NL = len(SENSORS), 3
NQ, NU, NX = 4, 1, 10  # four rotations and their speeds, two states of the amplifier


class LduParameters(Settings):
    """Parameters of appendix F; those not given come from the named set."""

    R_s: float = quantity(1.5e-3, unit="m", gt=0, help="radius of the motor shaft")
    R_t: float = quantity(3.0e-2, unit="m", gt=0, help="radius of the transmission wheel")
    R_c: float = quantity(3.0e-3, unit="m", gt=0, help="radius of the capstan")
    k_s: float = quantity(4.2, unit="Nm/rad", gt=0, help="stiffness of the motor shaft")
    k_c: float = quantity(7.6, unit="Nm/rad", gt=0, help="stiffness of each half of the capstan")
    b_s: float = quantity(1.91e-5, unit="Nms/rad", ge=0, help="damping of the motor shaft")
    b_c: float = quantity(8.13e-4, unit="Nms/rad", ge=0, help="damping of each half of the capstan")
    J_m: float = quantity(1e-6, unit="kg*m^2", gt=0, help="inertia of the motor")
    J_t: float = quantity(1e-5, unit="kg*m^2", gt=0, help="inertia of the transmission wheel")
    J_c: float = quantity(1e-7, unit="kg*m^2", gt=0, help="inertia of the capstan")
    J_e: float = quantity(3e-6, unit="kg*m^2", gt=0, help="inertia of the encoder")
    M: float = quantity(1.25, unit="kg", gt=0, help="mass of the carriage")
    K_m1: float = quantity(21e-3, unit="Nm/A", gt=0, help="motor constant")
    K_m2: float = quantity(5e-8, unit="Nms/rad", ge=0, help="speed/torque gradient of the motor")
    B_c: float = quantity(1e-6, unit="Nms/rad", ge=0, help="viscous friction of the capstan's bearing")
    B_m: float = quantity(0.5, unit="N*s/m", ge=0, help="viscous friction of the carriage")
    F_c: float = quantity(
        7.3, unit="N", ge=0, help="dry friction of the carriage: breaks away at 0.88 to 0.93 V (12.6)"
    )


SETS = {
    "figure_12_2": {},
    "appendix_f": {"k_s": 10.0, "k_c": 100.0, "M": 5.0, "b_s": 2.9e-5, "b_c": 2.9e-3},
}


class LduSettings(Settings):
    kind: Literal["ldu"] = "ldu"
    set: Literal["figure_12_2", "appendix_f"] = Field(
        default="figure_12_2", description="parameters where none are given"
    )
    parameters: LduParameters = LduParameters()


class LduParams(NamedTuple):
    """Symbols of the thesis, and the same numbers for the kernel of described machines."""

    h: float
    N: float
    R_c: float
    k_s: float
    k_c: float
    b_s: float
    b_c: float
    J_m: float
    J_t: float
    J_c: float
    J_e: float
    M: float
    K_m1: float
    K_m2: float
    B_c: float
    B_m: float
    F_c: float
    graph: GraphParams


LDU_STATE = GRAPH_STATE


def described() -> Machine:
    """The description of the machine."""
    return machine(Path(__file__).with_name("ldu.yaml"))


def parameters(settings: LduSettings) -> LduParameters:
    """The named set, overridden by the settings."""
    return LduParameters(**{**SETS[settings.set], **settings.parameters.model_dump(exclude_unset=True)})


def build(settings: LduSettings, h: float, drive: tuple[float, float]) -> LduParams:
    """Params for substeps of `h` s; `drive` is the natural frequency (rad/s) and damping of the amplifier."""
    p = parameters(settings)
    return params({**p.model_dump(), "N": p.R_t / p.R_s}, h, drive)


def params(symbols: Mapping[str, float], h: float, drive: tuple[float, float]) -> LduParams:
    """As `build`, from the values of the symbols."""
    amplifier = {"drives.drive.bandwidth_hz": drive[0] / (2.0 * np.pi), "drives.drive.damping": drive[1]}
    own = {name: symbols[name] for name in LduParams._fields[1:-1]}
    return LduParams(h=h, **own, graph=described().build(symbols, amplifier, h))


def state_space(p: LduParams) -> tuple[np.ndarray, np.ndarray]:
    """A (10, 10) and B (10, 1), amperes in, without dry friction, for design and tests."""
    return plant.state_space(p.graph)


NAME = "ldu"
SPOTS = {  # node -> coordinate, factor, channel
    "carriage": (CAPSTAN, "R_c", SENSORS["scale"]),
    "scale": (CAPSTAN, "R_c", SENSORS["scale"]),
    "loop": (CAPSTAN, "R_c", 0),  # common to all sensors: the carriage for the scale
}
SHOWN = Shown(
    axes=(),
    drives=((6e3, 0.7),),
    parameters={},
    units=("rad", "Nm"),
    scales={"force": 1e-3, "speed": 10.0, "travel": 6.0, "inertia": 1e-5, "stiffness": 7.6, "contact": 7.0},
    ratios=lambda p: [p.N, 1.0, 1.0, 1.0],
)
OWN = Own(
    inputs={"u": "volts", "i": "ldu_amplifier.drive(p.amplifier, volts, forward)"},
    sensors=("encoder", "scale"),
    truth=("scale", "v", "i"),
    unit="m",
    node="carriage",
    drag=50.0,
    gains=("gain: 6400 V/m", "tau_d: 27 ms", "derivative_filter: 200 Hz"),
    cutoff=200.0,
)
