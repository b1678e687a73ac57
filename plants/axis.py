"""One mass on a guide: a linear or rotary axis, optionally held by a spring.

    M x'' = K u - F_v x' - k x - F_c sign(x')

The plainest machine that a drive moves, and the owner's model of many real ones (ball screws, belts, unloaded
motors). For a rotary axis read J, rad and Nm for M, m and N.

Source: Janot, Gautier & Brunot, Data set and reference models of EMPS (2019) for the form.
"""

from typing import Literal, NamedTuple

import numpy as np

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants import linear
from rtctl.plants.element import LOOP, element

CARRIAGE = 0
NODES = {"carriage": CARRIAGE}
LINKS = {"carriage": 0}  # the spring to the frame
DRIVES = {"drive": 0}
RUBS = {"drive": CARRIAGE}  # where the dry friction is that a drive works against
SENSORS = {"sensor": 0}
ELEMENTS = (
    element("carriage", "body", "turns slides driven dry rubs rotor loaded bounded"),
    element("carriage", "joint", "spring ground"),
    element("drive", "drive", "force supply"),
    element("sensor", "sensor", "position turns slides driven guided lone feedback"),
    LOOP,
)
NQ, NU, NX, NY, NL = 1, 1, 2, len(SENSORS), len(LINKS)


class AxisParameters(Settings):
    """What the axis weighs, and what holds it back."""

    M: float = quantity(95.1, unit="kg", gt=0, help="moving mass seen at the carriage")
    K: float = quantity(35.15, unit="N/V", gt=0, help="force per volt of command")
    F_v: float = quantity(203.5, unit="N*s/m", ge=0, help="viscous friction")
    F_c: float = quantity(20.4, unit="N", ge=0, help="dry friction")
    k: float = quantity(0.0, unit="N/m", ge=0, help="spring to the frame; 0 for a free axis")


class AxisSettings(Settings):
    kind: Literal["axis"] = "axis"
    parameters: AxisParameters = AxisParameters()


class AxisParams(NamedTuple):
    h: float
    M: float
    K: float
    F_v: float
    F_c: float
    k: float


AXIS_STATE = state(m=linear.MACHINE)


def build(settings: AxisSettings, h: float) -> AxisParams:
    """Params for substeps of `h` s."""
    return AxisParams(h, **settings.parameters.model_dump())


@tick
def assemble(p, A, G):
    """Fill A (2, 2) and G = [volts | force] (2, 2)."""
    A[0, 0] = 0.0
    A[0, 1] = 1.0
    A[1, 0] = -p.k / p.M
    A[1, 1] = -p.F_v / p.M
    G[0, 0] = 0.0
    G[0, 1] = 0.0
    G[1, 0] = p.K / p.M
    G[1, 1] = 1.0 / p.M


@tick
def start(p, s):
    """Matrices and dry friction; position and speed stay as they are (zero at first)."""
    linear.size(s.m, NQ, NX, NU, NY, NL)
    s.m.h = p.h
    s.m.dry_base[CARRIAGE] = p.F_c
    assemble(p, s.m.A, s.m.G)
    linear.discretise_machine(s.m)
    linear.link(s.m, 0, CARRIAGE, 1.0, CARRIAGE, 0.0, p.k, 0.0)


@tick
def read(s):
    """What the sensor would show, m or rad, into s.m.y."""
    s.m.y[0] = s.m.x[CARRIAGE]


def state_space(p: AxisParams) -> tuple[np.ndarray, np.ndarray]:
    """A (2, 2) and B (2, 1), volts in, without dry friction."""
    A, G = np.zeros((NX, NX)), np.zeros((NX, NU + NQ))
    assemble.interpret(p, A, G)
    return A, G[:, :NU]
