"""The Image Verification Unit: two motors pull a paper tape over a capstan, each through a shaft and a reel.

    J_1  phi_1''  = F_s1 R_1 + tau_m1            J_2  phi_2''  = F_s2 R_2 + tau_m2                      (4.9, 4.12)
    J_m1 phi_m1'' = K_m1 I_1 - tau_m1 - tau_F1   J_m2 phi_m2'' = K_m2 I_2 - tau_m2 - tau_F2             (4.10, 4.13)
    J_c  phi_c''  = R_c (F_s2 - F_s1) - tau_Fc                                                          (4.11)
    tau_mi = c_mi (phi_mi - phi_i) + k_mi (phi_mi' - phi_i')                                            (4.14, 4.15)
    F_s1 = c_1 ( phi_c R_c - l_1) + k_1 ( phi_c' R_c - l_1'),  l_i' = R_i phi_i'                        (4.16)
    F_s2 = c_2 (-phi_c R_c - l_2) + k_2 (-phi_c' R_c - l_2')                                            (4.17)

l_i is the tape that reel i has wound, R_i phi_i while the radius stays what it is. A positive torque on either motor
winds tape and pulls it taut: the tensions are T_i = -F_si. Capstan and reel 1 turn the same way, reel 2 the other.

As tape moves, R_i = R_i(0) + d_tape phi_i / 2 pi (4.3, 4.4) and J_i follows R_i^4 (4.1, 4.2). The layer that lands
moves at the reel's own surface speed and brings its momentum with it, so that J phi'' has no J' phi' beside it.
The linear model is taken anew when a radius has moved by half a percent; in between the difference is a force.

Source: thesis chapter 4 and appendix A. Erratum: appendix A prints the identified R_c as 1.25e-3, it is 1.25e-2 m;
the simulation set has J_m twice too small for its own process gain; its 250 Hz mode needs J_10 of 3.2e-5.
"""

from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants import linear
from rtctl.plants.element import LOOP, element

MOTOR1, REEL1, CAPSTAN, REEL2, MOTOR2 = range(5)
NODES = {"motor1": MOTOR1, "reel1": REEL1, "capstan": CAPSTAN, "reel2": REEL2, "motor2": MOTOR2}
LINKS = {"tape1": 0, "tape2": 1, "motor1": 2, "motor2": 3}  # the tapes, and the shaft behind each motor
DRIVES = {"drive1": 0, "drive2": 1}
RUBS = {"drive1": MOTOR1, "drive2": MOTOR2}  # where the dry friction is that a drive works against
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
RELINEARISE = 5e-3  # of a radius: the explicit correction forces stay a hundred times below the linear ones


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
}  # fmt: skip


class IvuSettings(Settings):
    kind: Literal["ivu"] = "ivu"
    set: Literal["identified", "simulation"] = Field(
        default="identified", description="parameters where none are given: chapter 8, or chapter 6"
    )
    parameters: IvuParameters = IvuParameters()


class IvuParams(NamedTuple):
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
    rho_h: float  # rho_tape h_tape, kg/m^2
    d_tape: float
    tau_F1: float
    tau_F2: float
    tau_Fc: float
    drive: np.ndarray  # (2, 4) of each driver: gain A/V, natural frequency rad/s, damping, zero s


IVU_STATE = state(
    m=linear.MACHINE,
    R1=float,  # m, now
    R2=float,
    J1=float,  # kg m^2, now
    J2=float,
    R1_lin=float,  # and when the matrices were last taken
    R2_lin=float,
    J1_lin=float,
    J2_lin=float,
    T1=float,  # N, as `tensions` wrote it
    T2=float,
)


def parameters(settings: IvuSettings) -> IvuParameters:
    """The named set with what the settings say otherwise, J_1 and J_2 filled in."""
    given = settings.parameters.model_dump(exclude_unset=True)
    p = IvuParameters(**{**SETS[settings.set], **given})
    fill = {}
    if p.J_1 is None:
        fill["J_1"] = reel_inertia.py_func(p.J_10, p.rho_tape * p.h_tape, p.R1, p.R_min)
    if p.J_2 is None:
        fill["J_2"] = reel_inertia.py_func(p.J_20, p.rho_tape * p.h_tape, p.R2, p.R_min)
    return p.model_copy(update=fill)


def build(settings: IvuSettings, h: float, drives: list[tuple[float, float, float, float]]) -> IvuParams:
    """Params for substeps of `h` s; `drives` gives A/V, natural frequency (rad/s), damping and zero (s) of each."""
    p = parameters(settings)
    values = {name: getattr(p, name) for name in IvuParams._fields if hasattr(p, name)}
    return IvuParams(h=h, rho_h=p.rho_tape * p.h_tape, drive=np.array(drives, float), **values)


@tick
def reel_inertia(J_0, rho_h, R, R_min):
    """Inertia in kg m^2 of a reel with paper up to radius R (4.1)."""
    return J_0 + 0.5 * np.pi * rho_h * (R**4 - R_min**4)


@tick
def assemble(p, R1, R2, J1, J2, A, G):
    """Fill A (14, 14) and G = [volts | node torques] (14, 7) at the given radii and inertias."""
    for i in range(NX):
        for j in range(NX):
            A[i, j] = 0.0
        for j in range(NU + NQ):
            G[i, j] = 0.0
    for i in range(NQ):
        A[i, NQ + i] = 1.0
    _spring(A, MOTOR1, 1.0 / p.J_m1, REEL1, 1.0 / J1, 1.0, -1.0, p.c_m1, p.k_m1)
    _spring(A, MOTOR2, 1.0 / p.J_m2, REEL2, 1.0 / J2, 1.0, -1.0, p.c_m2, p.k_m2)
    _spring(A, REEL1, 1.0 / J1, CAPSTAN, 1.0 / p.J_c, R1, -p.R_c, p.c1, p.k1)
    _spring(A, REEL2, 1.0 / J2, CAPSTAN, 1.0 / p.J_c, R2, p.R_c, p.c2, p.k2)
    inertia = (p.J_m1, J1, p.J_c, J2, p.J_m2)
    for i in range(NQ):
        G[NQ + i, NU + i] = 1.0 / inertia[i]
    for d in range(2):
        a = 2 * NQ + 2 * d  # I = x + zero x', with x' = w z and z' = w (gain u - x) - 2 zeta w z
        gain, w, zeta = p.drive[d, 0], p.drive[d, 1], p.drive[d, 2]
        node = MOTOR1 if d == 0 else MOTOR2
        torque = (p.K_m1 if d == 0 else p.K_m2) * G[NQ + node, NU + node]
        A[a, a + 1] = w
        A[a + 1, a] = -w
        A[a + 1, a + 1] = -2.0 * zeta * w
        G[a + 1, d] = w * gain
        A[NQ + node, a] = torque
        A[NQ + node, a + 1] = torque * p.drive[d, 3] * w


@tick
def _spring(A, i, wi, j, wj, ai, aj, c, k):
    """A spring and damper of elongation ai q_i + aj q_j between two nodes of inverse inertias wi, wj."""
    nq = NQ
    A[nq + i, i] -= wi * ai * ai * c
    A[nq + i, j] -= wi * ai * aj * c
    A[nq + j, i] -= wj * aj * ai * c
    A[nq + j, j] -= wj * aj * aj * c
    A[nq + i, nq + i] -= wi * ai * ai * k
    A[nq + i, nq + j] -= wi * ai * aj * k
    A[nq + j, nq + i] -= wj * aj * ai * k
    A[nq + j, nq + j] -= wj * aj * aj * k


@tick
def start(p, s):
    """Matrices and dry friction for the starting radii; positions and speeds stay as they are (all zero at first)."""
    s.R1, s.R2, s.J1, s.J2 = p.R1, p.R2, p.J_1, p.J_2
    linear.size(s.m, NQ, NX, NU, NY, NL)
    s.m.h = p.h
    s.m.dry_base[MOTOR1] = p.tau_F1
    s.m.dry_base[MOTOR2] = p.tau_F2
    s.m.dry_base[CAPSTAN] = p.tau_Fc
    _linearise(p, s)


@tick
def _linearise(p, s):
    s.R1_lin, s.R2_lin, s.J1_lin, s.J2_lin = s.R1, s.R2, s.J1, s.J2
    assemble(p, s.R1, s.R2, s.J1, s.J2, s.m.A, s.m.G)
    linear.discretise_machine(s.m)
    linear.link(s.m, 0, REEL1, s.R1, CAPSTAN, -p.R_c, p.c1, p.k1)  # positive when taut
    linear.link(s.m, 1, REEL2, s.R2, CAPSTAN, p.R_c, p.c2, p.k2)
    linear.link(s.m, 2, MOTOR1, 1.0, REEL1, -1.0, p.c_m1, p.k_m1)
    linear.link(s.m, 3, MOTOR2, 1.0, REEL2, -1.0, p.c_m2, p.k_m2)


@tick
def read(s):
    """What the sensors would show, rad, into s.m.y."""
    s.m.y[0], s.m.y[1], s.m.y[2] = s.m.x[CAPSTAN], s.m.x[REEL1], s.m.x[REEL2]


@tick
def follow_tape(p, s):
    """Radii and inertias that follow the tape (4.3-4.8), as forces on top of the model that is linear in between."""
    m = s.m
    grow = p.d_tape / (2.0 * np.pi)
    q1, q2, v1, v2 = m.qm[REEL1], m.qm[REEL2], m.vm[REEL1], m.vm[REEL2]
    s.R1 = max(p.R1 + grow * q1, p.R_min)
    s.R2 = max(p.R2 + grow * q2, p.R_min)
    s.J1 = p.J_1 + 0.5 * np.pi * p.rho_h * (s.R1**4 - p.R1**4)
    s.J2 = p.J_2 + 0.5 * np.pi * p.rho_h * (s.R2**4 - p.R2**4)
    if abs(s.R1 - s.R1_lin) > RELINEARISE * s.R1_lin or abs(s.R2 - s.R2_lin) > RELINEARISE * s.R2_lin:
        _linearise(p, s)
    l1 = wound(q1, p.R1, grow, p.R_min)
    l2 = wound(q2, p.R2, grow, p.R_min)
    x, dx = p.R_c * m.qm[CAPSTAN], p.R_c * m.vm[CAPSTAN]
    F1_lin = p.c1 * (x - s.R1_lin * q1) + p.k1 * (dx - s.R1_lin * v1)
    F2_lin = p.c2 * (-x - s.R2_lin * q2) + p.k2 * (-dx - s.R2_lin * v2)
    F1 = p.c1 * (x - l1) + p.k1 * (dx - s.R1 * v1)
    F2 = p.c2 * (-x - l2) + p.k2 * (-dx - s.R2 * v2)
    m.link_e[0] = l1 - s.R1_lin * q1
    m.link_e[1] = l2 - s.R2_lin * q2
    m.link_T[0] += F1_lin - F1 - p.c1 * m.link_e[0]  # with these linear.tension tells the tension on the true radius
    m.link_T[1] += F2_lin - F2 - p.c2 * m.link_e[1]
    tau1 = p.c_m1 * (m.qm[MOTOR1] - q1) + p.k_m1 * (m.vm[MOTOR1] - v1)
    tau2 = p.c_m2 * (m.qm[MOTOR2] - q2) + p.k_m2 * (m.vm[MOTOR2] - v2)
    m.f[REEL1] += (F1 * s.R1 + tau1) * (s.J1_lin / s.J1) - (F1_lin * s.R1_lin + tau1)
    m.f[REEL2] += (F2 * s.R2 + tau2) * (s.J2_lin / s.J2) - (F2_lin * s.R2_lin + tau2)
    m.f[CAPSTAN] += p.R_c * ((F2 - F2_lin) - (F1 - F1_lin))


@tick
def wound(q, R, grow, R_min):
    """Tape wound by a reel of radius `R` that turns by `q` and grows by `grow` per radian; its core stays R_min."""
    if R + grow * q >= R_min:
        return (R + 0.5 * grow * q) * q
    q_end = (R_min - R) / grow
    return (R + 0.5 * grow * q_end) * q_end + R_min * (q - q_end)


@tick
def tensions(s):
    """Write the tape tensions T1, T2 in N into the state, positive when taut, with the pull of every term of physics.

    They are those of the last substep, at its middle; 0 before the first.
    """
    s.T1, s.T2 = linear.tension(s.m, 0), linear.tension(s.m, 1)


def state_space(p: IvuParams) -> tuple[np.ndarray, np.ndarray]:
    """A (14, 14) and B (14, 2), volts in, at the starting radii and without dry friction, for design and tests."""
    A, G = np.zeros((NX, NX)), np.zeros((NX, NU + NQ))
    assemble.interpret(p, p.R1, p.R2, p.J_1, p.J_2, A, G)
    return A, G[:, :NU]
