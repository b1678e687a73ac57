"""One mass on a guide: a linear or rotary axis, optionally held by a spring.

    M x'' = K u - F_v x' - k x - F_c sign(x')

The simplest driven machine, and the nominal model of many real machines (ball screws, belts, unloaded motors). For a
rotary axis read J, rad and Nm for M, m and N. The machine runs by its description axis.yaml.

Source: Janot, Gautier & Brunot, Data set and reference models of EMPS (2019) for the form.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from rtctl.idiom import Settings, quantity
from rtctl.plants.element import LOOP, element
from rtctl.plants.graph import plant
from rtctl.plants.graph.params import GraphParams
from rtctl.plants.graph.plant import GRAPH_STATE
from rtctl.plants.graph.symbols import Machine, machine
from rtctl.plants.shown import Own, Shown

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
    """Mass, friction, spring and drive constant of the axis."""

    M: float = quantity(95.1, unit="kg", gt=0, help="moving mass seen at the carriage")
    K: float = quantity(35.15, unit="N/V", gt=0, help="force per volt of command")
    F_v: float = quantity(203.5, unit="N*s/m", ge=0, help="viscous friction")
    F_c: float = quantity(20.4, unit="N", ge=0, help="dry friction")
    k: float = quantity(0.0, unit="N/m", ge=0, help="spring to the frame; 0 for a free axis")


class AxisSettings(Settings):
    kind: Literal["axis"] = "axis"
    parameters: AxisParameters = AxisParameters()


class AxisParams(NamedTuple):
    """Symbols of the equation, and the same numbers for the kernel of described machines."""

    h: float
    M: float
    K: float
    F_v: float
    F_c: float
    k: float
    graph: GraphParams


AXIS_STATE = GRAPH_STATE


def described() -> Machine:
    """The description of the machine."""
    return machine(Path(__file__).with_name("axis.yaml"))


def build(settings: AxisSettings, h: float) -> AxisParams:
    """Params for substeps of `h` s."""
    return params(settings.parameters.model_dump(), h)


def params(symbols: Mapping[str, float], h: float) -> AxisParams:
    """As `build`, from the values of the symbols; missing symbols are 0."""
    own = {name: symbols.get(name, 0.0) for name in AxisParams._fields[1:-1]}
    return AxisParams(h=h, **own, graph=described().build(own, {}, h))


def state_space(p: AxisParams) -> tuple[np.ndarray, np.ndarray]:
    """A (2, 2) and B (2, 1), volts in, without dry friction."""
    return plant.state_space(p.graph)


NAME = "axis"
SPOTS: dict[str, tuple[int, str, int]] = {}  # node -> coordinate, factor, channel, where NODES does not say it
SHOWN = Shown(
    axes=(),
    drives=(),
    parameters={"k": 200.0},
    units=("m", "N"),
    scales={"force": 20.4, "speed": 0.1, "travel": 0.1, "inertia": 95.1, "stiffness": 200.0, "contact": 20.0},
    ratios=lambda p: [1.0],
)
OWN = Own(
    inputs={"u": "volts"},
    sensors=("x",),
    truth=("x", "v"),
    unit="m",
    node="carriage",
    drag=50.0,
    gains=("gain: 39000 V/m", "tau_d: 6 ms", "derivative_filter: 100 Hz"),
)
