"""Drives with memory: a lag of the current, and a motor that warms.

Both steps are exact for a command that is held over the substep; the lag gives the mean of its response over it.
`drive.thermal` at a drive lowers the gain (resistance and magnets), and with `ease` the dry friction on which the drive
acts (grease). At a node or body with dry friction it lowers the dry friction alone. The heat is that of the motor's
current, or of the currents of all motors.

Source: Astrom & Wittenmark, Computer-Controlled Systems (1997), 2.3 for the held input; Krishnan, Electric Motor
Drives (2001), 2.8 for the thermal model of first order.
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

THERMAL_FORMS = ("exponential", "linear", "hyperbolic")
LEAST = 0.05  # least gain or friction, as a share of the cold value


class LagSettings(Settings):
    """tau is the size: how late a slow command acts. Order 2 has the damping zeta and its natural frequency at
    2 zeta/tau rad/s."""

    term: Literal["drive.lag"] = "drive.lag"
    node: Node
    tau: float = quantity(unit="s", ge=0, le=10, help="time constant of the lag; 0 is no lag")
    order: Literal[1, 2] = Field(default=1, description="order of the lag")
    zeta: float = quantity(0.7, unit="", ge=0.05, le=20, help="damping of order 2")


class LagParams(NamedTuple):
    end: float  # e+ = end e + end_d d with e = y - u and d = y' in units of its own time
    end_d: float
    back: float  # d+ = back e + back_d d
    back_d: float
    mean: float  # of e over the substep
    mean_d: float


LAG_STATE = state(y=float, d=float)


def build_lag(settings: LagSettings, h: float) -> LagParams:
    """Exact transition over `h` s and mean of the response to a held input."""
    tau = max(settings.tau, 0.0)
    if tau == 0.0:
        return LagParams(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    x = h / tau
    if settings.order == 1:
        end = math.exp(-x)
        return LagParams(end, 0.0, 0.0, 0.0, -math.expm1(-x) / x, 0.0)
    zeta = settings.zeta
    x *= 2.0 * zeta
    end, end_d, back, back_d = second_order.transition(x, zeta)
    # The mean is A^-1 (Phi - I) / x with A = [[0, 1], [-1, -2 zeta]], in e and d.
    mean = (-2.0 * zeta * (end - 1.0) - back) / x
    mean_d = (-2.0 * zeta * end_d - (back_d - 1.0)) / x
    return LagParams(end, end_d, back, back_d, mean, mean_d)


@tick
def lag(p, s, u):
    """Mean volts over a substep at a command of `u` volts."""
    e, d = s.y - u, s.d
    s.y = u + p.end * e + p.end_d * d
    s.d = p.back * e + p.back_d * d
    return u + p.mean * e + p.mean_d * d


class ThermalSettings(Settings):
    """a is the size: exp(-a) of the gain, or of the friction, is left after a long time at V_ref. Where little is lost
    the forms are alike."""

    term: Literal["drive.thermal"] = "drive.thermal"
    node: Node
    a: float = quantity(unit="", ge=-2, le=5, help="loss at V_ref when warm; negative: an increase")
    tau: float = quantity(30.0, unit="s", gt=0, le=1e5, help="time constant of the warming")
    V_ref: float = quantity(1.0, unit="V", gt=0, le=100, help="steady command of the loss a")
    ease: float = quantity(
        0.0, unit="", ge=-2, le=5, help="of a drive: loss of the dry friction at its body when warm, as a"
    )
    form: Literal["exponential", "linear", "hyperbolic"] = Field(
        default="exponential",
        description="factor of the gain at heat h: exp(-a h), 1 - a h (magnets), 1/(1 + a h) (resistance)",
    )


class ThermalParams(NamedTuple):
    gain: float  # loss of each at V_ref
    friction: float
    form: int
    end: float  # exp(-h/tau)
    per_volt2: float
    channel: int
    a: float  # of a described machine: loss of the gain of a drive, or of the friction of a body
    ease: float  # and of the friction that a drive works against


THERMAL_STATE = state(heat=float)


def build_thermal(settings: ThermalSettings, h: float) -> ThermalParams:
    """Exact decay over `h` s; a node of a plant that is no drive has the friction of what that drive moves."""
    losses = (settings.a, settings.ease) if settings.node.startswith("drive") else (0.0, settings.a)
    form, channel = THERMAL_FORMS.index(settings.form), 1 if settings.node.endswith("2") else 0
    warm = math.exp(-h / settings.tau)
    return ThermalParams(*losses, form, warm, settings.V_ref**-2, channel, settings.a, settings.ease)


@tick
def left(p, lost):
    """Remaining gain or friction as a share of the cold value."""
    if p.form == 0:
        return math.exp(-lost)
    if p.form == 1:
        return max(1.0 - lost, LEAST)
    return 1.0 / max(1.0 + lost, LEAST)


@tick
def thermal_gain(p, s, volts, c, loss):
    """Warm the motor by volts `c` of the `volts` (n,) over a substep and lower these volts by the loss; no action at a
    body, where c is below zero."""
    if c < 0:
        return
    u = volts[c]
    load = u * u * p.per_volt2
    volts[c] = u * left(p, loss * s.heat)
    s.heat = load + (s.heat - load) * p.end


@tick
def thermal_friction(p, s, dry, loss):
    """Dry friction of a warm motor with the cold dry friction `dry`, Nm or N."""
    return dry * left(p, loss * s.heat)


@tick
def thermal_dry(p, s, m, i, c):
    """Dry friction of coordinate `i` of a described machine, Nm or N, on which a warm drive `c` acts, or of a body
    (c below zero) that the drives of the machine warm."""
    if c >= 0:
        return thermal_friction(p, s, m.dry[i], p.ease)
    load = 0.0
    for d in range(m.nu):
        load += m.volts[d] * m.volts[d] * p.per_volt2
    dry = thermal_friction(p, s, m.dry[i], p.a)
    s.heat = load + (s.heat - load) * p.end
    return dry


BY_NAME = (  # of a plant whose nodes are motors as well as drives
    "drive_dynamics.thermal_gain({p}, {s}, {m}.volts, {p}.channel, {p}.gain)",
    "{m}.dry[{i}] = drive_dynamics.thermal_friction({p}, {s}, {m}.dry[{i}], {p}.friction)",
)
LAG = Term(
    name="drive.lag",
    remedies=("feedforward", "lead"),
    words="it comes late and soft: the drive needs a moment to build up what is asked for",
    equation="tau y' = u - y, or (tau/(2 zeta))^2 y'' + tau y' + y = u",
    source="Astrom & Wittenmark 1997, 2.3",
    settings=LagSettings,
    build=build_lag,
    act={"command": "{m}.volts[{c}] = drive_dynamics.lag({p}, {s}, {m}.volts[{c}])"},
    stands=(stand("drive"),),
    look_alikes={
        "timing.delay": "a sweep up to half the sample rate: a lag weakens the fast part, a delay only turns its phase",
        "structure.resonance": "a sweep: the gain of a lag only falls, a resonance has a peak",
        "tape.viscoelastic": "one motor with the tape off: a lag stays",
        "drive.saturation": "small and large steps: a lag takes the same time for both, a limit changes the large",
    },
    typical={"tau": (0.3, 3.0)},
    scale={"tau": "sample period"},
    axis="frequency",
    order=30,
    state=LAG_STATE,
    phrase=Phrase(
        noun="a lag",
        head="{here} responds with a lag",
        detail="its output follows the command with a time constant of {tau}",
        need="quick changes of the command",
    ),
    check="Look for a filter on the command input and at the gains of the current loop.",
    search=(Size("tau", "tick", 0.5, blur="driver"), Choice("order", (1, 2))),
    richer=(Shape("zeta", "one", (1.0,), 5.0), Choice("order", (2,))),
    chosen={"order": (1, 2)},
)
THERMAL = Term(
    name="drive.thermal",
    remedies=("feedforward", "observer"),
    words="it changes as it warms: after hard work the same command gives another push, or the grease runs easier",
    equation="gain exp(-a h), 1 - a h, or 1/(1 + a h); tau h' = (u/V_ref)^2 - h",
    source="Krishnan 2001, 2.8",
    settings=ThermalSettings,
    build=build_thermal,
    act={
        "command": "drive_dynamics.thermal_gain({p}, {s}, {m}.volts, {c}, {p}.a)",
        "force": "{m}.dry[{i}] = drive_dynamics.thermal_dry({p}, {s}, {m}, {i}, {c})",
        **{f"command:{kind}": BY_NAME[0] for kind in ("ivu", "ldu", "axis")},
        **{f"force:{kind}": BY_NAME[1] for kind in ("ivu", "ldu", "axis")},
    },
    stands=(
        stand("drive"),
        stand("body", "rubs"),
    ),
    look_alikes={
        "drive.supply_sag": "the same burst cold and after a minute of work: sag shows from the first moment",
        "geometry.radius_change": "wind there and back slowly: a radius comes back with the tape, heat does not",
        "friction.coulomb": "the same slow move cold and warm: Coulomb friction does not change",
    },
    typical={"a": (0.05, 0.4)},
    axis="time",
    order=30,
    passive=False,
    state=THERMAL_STATE,
    phrase=Phrase(
        noun="thermal drift",
        head="{here} changes as it warms",
        detail="{a:%} {a:weaker|stronger} once warm, with a time constant of {tau}",
        need="a longer time of hard work",
    ),
    check="Feel the motor and the amplifier after hard work, and look at the cooling and at the grease.",
    search=(
        Size("a", "one", 0.1, signed=True),
        Shape("tau", "duration", (0.1, 0.5, 2.0), 5.0),
        Choice("V_ref", (1.0,), "volts"),
    ),
    richer=(Size("ease", "one", 0.1, signed=True),),
    variants=Choice("form", ("exponential", "linear", "hyperbolic")),
    richer_at="drive",
    draws={"a": Draw(0.05, 0.4), "tau": Draw(3.0, 30.0), "V_ref": Draw(1.0, 1.0, "volts")},
)
