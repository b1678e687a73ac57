"""The Image Verification Unit: two motors pull a paper tape over a capstan, each through a shaft and a reel.

    J_1  phi_1''  = F_s1 R_1 + tau_m1            J_2  phi_2''  = F_s2 R_2 + tau_m2                      (4.9, 4.12)
    J_m1 phi_m1'' = K_m1 I_1 - tau_m1 - tau_F1   J_m2 phi_m2'' = K_m2 I_2 - tau_m2 - tau_F2             (4.10, 4.13)
    J_c  phi_c''  = R_c (F_s2 - F_s1) - tau_Fc                                                          (4.11)
    tau_mi = c_mi (phi_mi - phi_i) + k_mi (phi_mi' - phi_i')                                            (4.14, 4.15)
    F_s1 = c_1 ( phi_c R_c - l_1) + k_1 ( phi_c' R_c - l_1'),  l_i' = R_i phi_i'                        (4.16)
    F_s2 = c_2 (-phi_c R_c - l_2) + k_2 (-phi_c' R_c - l_2')                                            (4.17)

l_i is the tape that reel i has wound, R_i phi_i at constant radius. A positive torque on either motor winds tape and
pulls it taut: the tensions are T_i = -F_si. Capstan and reel 1 turn in one direction, reel 2 in the other.

As tape moves, R_i = R_i(0) + d_tape phi_i / 2 pi (4.3, 4.4) and J_i follows R_i^4 (4.1, 4.2). The layer that lands
moves at the reel's own surface speed and brings its momentum with it, so that J phi'' has no J' phi' beside it.
The machine runs as ivu.yaml describes it, by the kernel of all machines (plants/graph/reel.py for what winds).

Source: thesis chapter 4 and appendix A. Erratum: appendix A prints the identified R_c as 1.25e-3, it is 1.25e-2 m;
the simulation set has J_m twice too small for its own process gain; its 250 Hz mode needs J_10 of 3.2e-5.
Erratum: K_m = 61 mNm/A of both columns is that of a rotor of appendix E, and so is the identified friction, about; the
set appendix_e has both behind the gear of 150.4. A tape cannot turn that gear back: 0.22 Nm are 11 N at 20 mm.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings, quantity
from rtctl.plants.element import LOOP, element
from rtctl.plants.graph import plant
from rtctl.plants.graph.params import GraphParams
from rtctl.plants.graph.plant import GRAPH_STATE
from rtctl.plants.graph.reel import reel_inertia
from rtctl.plants.graph.symbols import Machine, machine
from rtctl.plants.shown import Own, Shown

MOTOR1, REEL1, CAPSTAN, REEL2, MOTOR2 = range(5)
NODES = {"motor1": MOTOR1, "reel1": REEL1, "capstan": CAPSTAN, "reel2": REEL2, "motor2": MOTOR2}
LINKS = {"tape1": 0, "tape2": 1, "motor1": 2, "motor2": 3}  # the tapes, and the shaft behind each motor
DRIVES = {"drive1": 0, "drive2": 1}
RUBS = {"drive1": MOTOR1, "drive2": MOTOR2}  # coordinate of the dry friction on which a drive acts
SENSORS = {"encoder": 0, "reel1": 1, "reel2": 2}
ELEMENTS = (
    element("motor1", "body", "turns driven dry rubs rotor loaded"),
    element("motor2", "body", "turns driven dry rubs rotor loaded"),
    element("reel1", "body", "turns load reel rotor loaded"),
    element("reel2", "body", "turns load reel rotor loaded"),
    element("capstan", "body", "turns load capstan dry rotor loaded wrapped"),
    element("tape1", "joint", "spring span"),
    element("tape2", "joint", "spring span"),
    element("motor1", "joint", "spring shaft"),
    element("motor2", "joint", "spring shaft"),
    element("capstan", "joint", "contact span"),
    element("drive1", "drive", "current supply"),
    element("drive2", "drive", "current"),
    element("encoder", "sensor", "position counts turns load feedback"),
    element("reel1", "sensor", "edges counts turns load"),
    element("reel2", "sensor", "edges counts turns load"),
    LOOP,
)
NY, NL = len(SENSORS), len(LINKS)
NQ, NU, NX = 5, 2, 14  # five rotations and their speeds, two states of each motor driver


class IvuParameters(Settings):
    """Appendix A, identified set where not given. J_1 and J_2 follow from the radii (4.1, 4.2) where not given."""

    R1: float = quantity(0.038, unit="m", gt=0.005, le=0.2, help="radius of reel 1 with its paper")
    R2: float = quantity(0.022, unit="m", gt=0.005, le=0.2, help="radius of reel 2 with its paper")
    R_c: float = quantity(0.0125, unit="m", gt=0.001, le=0.1, help="radius of the capstan")
    R_min: float = quantity(0.020, unit="m", gt=0.001, le=0.2, help="radius of an empty reel")
    J_m1: float = quantity(1.5e-3, unit="kg*m^2", gt=0, help="inertia of motor 1 behind its gear")
    J_m2: float = quantity(1.5e-3, unit="kg*m^2", gt=0, help="inertia of motor 2 behind its gear")
    J_10: float = quantity(1e-6, unit="kg*m^2", gt=0, help="inertia of the empty reel 1")
    J_20: float = quantity(1e-6, unit="kg*m^2", gt=0, help="inertia of the empty reel 2")
    J_c: float = quantity(5e-6, unit="kg*m^2", gt=0, help="inertia of the capstan")
    J_1: float | None = quantity(None, unit="kg*m^2", gt=0, help="inertia of reel 1 with its paper, instead of (4.1)")
    J_2: float | None = quantity(None, unit="kg*m^2", gt=0, help="inertia of reel 2 with its paper, instead of (4.2)")
    c_m1: float = quantity(12.0, unit="Nm/rad", gt=0, help="stiffness of motor shaft 1")
    c_m2: float = quantity(12.0, unit="Nm/rad", gt=0, help="stiffness of motor shaft 2")
    k_m1: float = quantity(1.3e-2, unit="Nms/rad", ge=0, help="damping of motor shaft 1")
    k_m2: float = quantity(1.3e-2, unit="Nms/rad", ge=0, help="damping of motor shaft 2")
    c1: float = quantity(450.0, unit="N/m", gt=0, help="stiffness of the tape between capstan and reel 1")
    c2: float = quantity(450.0, unit="N/m", gt=0, help="stiffness of the tape between capstan and reel 2")
    k1: float = quantity(12.5, unit="N*s/m", ge=0, help="damping of the tape between capstan and reel 1")
    k2: float = quantity(12.5, unit="N*s/m", ge=0, help="damping of the tape between capstan and reel 2")
    K_m1: float = quantity(0.061, unit="Nm/A", gt=0, help="motor constant 1")
    K_m2: float = quantity(0.061, unit="Nm/A", gt=0, help="motor constant 2")
    rho_tape: float = quantity(1700.0, unit="kg/m^3", gt=0, help="density of the paper")
    h_tape: float = quantity(0.037, unit="m", gt=0, help="width of the tape")
    d_tape: float = quantity(0.5e-3, unit="m", ge=0, help="thickness of the tape; 0 keeps the radii as they are")
    tau_F1: float = quantity(2.4e-3, unit="Nm", ge=0, help="dry friction of motor 1")
    tau_F2: float = quantity(2.6e-3, unit="Nm", ge=0, help="dry friction of motor 2 (slightly higher, 8.1)")
    tau_Fc: float = quantity(1e-4, unit="Nm", ge=0, help="dry friction of the capstan's bearing; not in the thesis")


SETS = {
    "identified": {},
    "simulation": {
        "R1": 0.040, "R2": 0.020, "J_m1": 7.5e-4, "J_m2": 7.5e-4, "J_10": 1e-5, "J_20": 1e-5,
        "c_m1": 80.0, "c_m2": 80.0, "k_m1": 1e-5, "k_m2": 1e-5, "c1": 100.0, "c2": 100.0, "k1": 10.0, "k2": 10.0,
        "tau_F1": 1e-3, "tau_F2": 1e-3, "tau_Fc": 0.0,
    },
    "appendix_e": {  # behind the gear of 150.4: K = 150.4 x 61 mNm/A, friction of 24 mA without load
        "J_m1": 1.5e-3, "J_m2": 1.5e-3, "K_m1": 9.174, "K_m2": 9.174, "tau_F1": 0.22, "tau_F2": 0.22,
    },
}  # fmt: skip


class IvuSettings(Settings):
    kind: Literal["ivu"] = "ivu"
    set: Literal["identified", "simulation", "appendix_e"] = Field(
        default="identified",
        description="parameters where none are given: chapter 8, chapter 6, or motors behind the gear of 150.4",
    )
    parameters: IvuParameters = IvuParameters()


class IvuParams(NamedTuple):
    """Symbols of the thesis, and the same numbers for the kernel of described machines."""

    h: float
    R1: float
    R2: float
    R_c: float
    R_min: float
    J_m1: float
    J_m2: float
    J_10: float
    J_20: float
    J_c: float
    J_1: float  # at the start
    J_2: float
    c_m1: float
    c_m2: float
    k_m1: float
    k_m2: float
    c1: float
    c2: float
    k1: float
    k2: float
    K_m1: float
    K_m2: float
    rho_tape: float
    h_tape: float
    rho_h: float  # rho_tape h_tape, kg/m^2
    d_tape: float
    tau_F1: float
    tau_F2: float
    tau_Fc: float
    graph: GraphParams


IVU_STATE = GRAPH_STATE


def described() -> Machine:
    """The description of the machine."""
    return machine(Path(__file__).with_name("ivu.yaml"))


def parameters(settings: IvuSettings) -> IvuParameters:
    """The named set, overridden by the settings, with J_1 and J_2 filled in."""
    given = settings.parameters.model_dump(exclude_unset=True)
    p = IvuParameters(**{**SETS[settings.set], **given})
    fill = {}
    if p.J_1 is None:
        fill["J_1"] = reel_inertia.py_func(p.J_10, p.rho_tape * p.h_tape, p.R1, p.R_min)
    if p.J_2 is None:
        fill["J_2"] = reel_inertia.py_func(p.J_20, p.rho_tape * p.h_tape, p.R2, p.R_min)
    return p.model_copy(update=fill)


def build(settings: IvuSettings, h: float, drives: Sequence[Sequence[float]], follow_tape: bool = True) -> IvuParams:
    """Params for substeps of `h` s; `drives` gives A/V, natural frequency (rad/s), damping and zero (s) of each.

    Without `follow_tape` the radii keep their values at the start.
    """
    p = parameters(settings)
    return params(p.model_dump(), h, drives, follow_tape)


def params(
    symbols: Mapping[str, float], h: float, drives: Sequence[Sequence[float]], follow_tape: bool = True
) -> IvuParams:
    """As `build`, from the values of the symbols."""
    all_of = {**symbols, "rho_h": symbols["rho_tape"] * symbols["h_tape"]}
    bridges: dict[str, float] = {}
    for name, (gain, w, zeta, zero) in zip(DRIVES, drives, strict=True):
        own = {"gain": gain, "bandwidth_hz": w / (2.0 * np.pi), "damping": zeta, "zero": zero}
        bridges |= {f"drives.{name}.{key}": float(value) for key, value in own.items()}
    taken = all_of if follow_tape else {**all_of, "d_tape": 0.0}
    own = {name: all_of[name] for name in IvuParams._fields[1:-1]}
    return IvuParams(h=h, **own, graph=described().build(taken, bridges, h))


def state_space(p: IvuParams) -> tuple[np.ndarray, np.ndarray]:
    """A (14, 14) and B (14, 2), volts in, at the starting radii and without dry friction, for design and tests."""
    return plant.state_space(p.graph)


NAME = "ivu"
SPOTS = {"encoder": (CAPSTAN, "", SENSORS.get("encoder", 0))}  # node -> coordinate, factor, channel
SHOWN = Shown(
    axes=("angle", "tension", "command"),
    drives=([(0.2, 2e3, 0.7, 0.0)] * 2,),
    parameters={"k1": 0.0, "k2": 0.0},
    units=("rad", "Nm"),
    scales={"force": 2.5e-3, "speed": 2.0, "travel": 6.0, "inertia": 1.5e-3, "stiffness": 450.0, "contact": 1.0},
    ratios=lambda p: [p.R_c / p.R1, p.R_c / p.R1, 1.0, -p.R_c / p.R2, -p.R_c / p.R2],
    links={"capstan": 1},
    stretches=True,
)
OWN = Own(
    inputs={"u1": "u1", "u2": "u2"},
    sensors=("capstan", "reel1", "reel2"),
    truth=("T1", "T2", "capstan", "motor1", "motor2", "R1", "R2"),
    unit="rad",
    node="reel1",
    drag=2e-5,
    gains=("gain: 31 V/rad", "tau_d: 160 ms", "derivative_filter: 40 Hz"),
)
