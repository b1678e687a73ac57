"""Lag of a sensor: its reading is a low-pass of the measured position or speed.

    tau y' = x - y,  or  T^2 y'' + tau y' + y = x  with  T = tau / (2 zeta)

The error of the reading is d = y - x; at order 2 its state includes the rate g = T y'. d and g decay towards their
steady values at the present rate of x. The step from one reading to the next is exact for an x that changes linearly
between them, for any tau. A second reading at one time equals the first.

Source: Astrom & Wittenmark, Computer-Controlled Systems (1997), 2.3; Harris & Piersol, Shock and Vibration Handbook
(2002), ch. 13 for the filters of sensors.
"""

import math
from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants.element import stand
from rtctl.plants.physics import second_order
from rtctl.plants.physics.search import Choice, Shape, Size
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term


class SensorLagSettings(Settings):
    """tau is the size: how late a steady motion is shown. Order 2 has the damping zeta and its natural frequency at
    2 zeta/tau rad/s."""

    term: Literal["sensor.lag"] = "sensor.lag"
    node: Node
    tau: float = quantity(unit="s", ge=0, le=10, help="delay of the reading of a steady motion")
    order: Literal[1, 2] = Field(default=1, description="order of the filter")
    zeta: float = quantity(1.0, unit="", ge=0.05, le=20, help="damping of order 2")


class SensorLagParams(NamedTuple):
    tau: float
    T: float  # of order 2, inverse natural frequency, s; 0: of order 1
    zeta: float


SENSOR_LAG_STATE = state(
    d=float,
    g=float,
    x=float,  # the reading before, and when it was
    t=float,
    begun=int,
)


def build_sensor_lag(settings: SensorLagSettings, h: float) -> SensorLagParams:
    """Nothing to discretise: the step is the time between two readings."""
    tau = max(settings.tau, 0.0)
    return SensorLagParams(tau, tau / (2.0 * settings.zeta) if settings.order == 2 else 0.0, settings.zeta)


@tick
def show(p, s, x, t):
    """Output of the filter for a reading `x` at time `t`; where the clock restarts, the filter keeps its error."""
    dt = t - s.t
    if s.begun == 1 and dt > 0.0:
        rest = -p.tau * (x - s.x) / dt  # steady error at the present rate of x
        if p.tau <= 0.0:
            s.d, s.g = 0.0, 0.0
        elif p.T == 0.0:
            s.d = rest + (s.d - rest) * math.exp(-dt / p.tau)
        else:
            rate = p.T * (x - s.x) / dt
            e, d = s.d - rest, s.g - rate
            end, end_d, back, back_d = second_order.transition(dt / p.T, p.zeta)
            s.d, s.g = rest + end * e + end_d * d, rate + back * e + back_d * d
    if s.begun == 0 or dt != 0.0:
        s.begun, s.x, s.t = 1, x, t
    return x + s.d


SENSOR_LAG = Term(
    name="sensor.lag",
    remedies=("behind",),
    words="the reading comes late and soft: it stays behind while the body moves, and is right at rest",
    equation="tau y' = x - y, or (tau/(2 zeta))^2 y'' + tau y' + y = x",
    source="Astrom & Wittenmark 1997, 2.3",
    settings=SensorLagSettings,
    build=build_sensor_lag,
    act={"reading": "{m}.y[{c}] = sensor_lag.show({p}, {s}, {m}.y[{c}], {m}.t)"},
    stands=(stand("sensor", "general position"), stand("sensor", "general speed")),
    look_alikes={
        "timing.delay": "two sensors on one body: a delay of the loop is late on both, a lag of one sensor on that one",
        "drive.lag": "move it by hand with the power off: a sensor that lags is still late",
        "sensor.scale": "stop and wait: a lag ends at the right value, a wrong scale factor does not",
        "friction.viscous": "stop and wait, with a second sensor: friction moves both readings alike",
    },
    typical={"tau": (0.5, 5.0)},
    scale={"tau": "sample period"},
    axis="frequency",
    order=175,
    since=2,
    state=SENSOR_LAG_STATE,
    phrase=Phrase(
        noun="a reading that lags",
        head="{here} reads with a lag",
        detail="its time constant is {tau}",
        need="quick moves, with a second sensor or a known command",
    ),
    check="Look for a filter in the sensor, its converter or the input card, and at the averaging that is set there.",
    search=(Size("tau", "tick", 1.0, blur="driver"),),
    richer=(Shape("zeta", "one", (1.0,), 5.0), Choice("order", (2,))),
    draws={"tau": Draw(0.5, 3.0, "tick")},
)
