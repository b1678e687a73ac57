"""Drives without memory: offset, dead band, another gain for each sign, a limit, and a supply that sags.

Each term maps the volts at the driver's input to the equivalent volts of an ideal driver.

Source: Slotine & Li, Applied Nonlinear Control (1991), 5.2 for dead zone and saturation; Krishnan, Electric Motor
Drives (2001), ch. 4 for converters and their supply.
"""

import math
from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Choice, Limit, Shape, Size
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term

DEADBAND_FORMS = ("shift", "cut", "floor")
SAG_FORMS = ("current", "power", "drawn")
FEEDS = ("all", "own")
SAG = (Size("k", "per_volt", 0.05), Choice("form", ("current", "power")))


class OffsetSettings(Settings):
    """offset is the size."""

    term: Literal["drive.offset"] = "drive.offset"
    node: Node
    offset: float = quantity(unit="V", ge=-10, le=10, help="input of the driver at a command of zero")


class OffsetParams(NamedTuple):
    offset: float


def build_offset(settings: OffsetSettings, h: float) -> OffsetParams:
    """Nothing to discretise."""
    return OffsetParams(settings.offset)


@tick
def offset(p, u):
    """Volts at the driver for a command of `u` volts."""
    return u + p.offset


class DeadbandSettings(Settings):
    """band is the size: half the width of the dead zone, so that nothing happens from -band to +band.

    shift: beyond the band the output starts from zero; cut: it jumps to the command; floor: within the band the output
    is +band or -band instead of nothing, by the sign of the command.
    """

    term: Literal["drive.deadband"] = "drive.deadband"
    node: Node
    band: float = quantity(unit="V", ge=0, le=5, help="half width of the dead zone")
    form: Literal["shift", "cut", "floor"] = Field(
        default="shift", description="output: from zero on beyond the band, a jump to the command, or at least +-band"
    )
    edge: float = quantity(0.1, unit="", ge=0, le=1, help="half width of the jump of `cut`, as a share of band")


class DeadbandParams(NamedTuple):
    band: float
    form: int
    edge: float  # V


def build_deadband(settings: DeadbandSettings, h: float) -> DeadbandParams:
    """Nothing to discretise."""
    return DeadbandParams(settings.band, DEADBAND_FORMS.index(settings.form), settings.edge * settings.band)


@tick
def deadband(p, u):
    """Volts at the driver for a command of `u` volts.

    A jump of no width would make the effect a staircase in `band`, one stair for each step of the DAC; hence the edge.
    """
    a = abs(u)
    if p.form == 0:
        return math.copysign(max(a - p.band, 0.0), u)
    if p.form == 2:
        return math.copysign(max(a, p.band), u) if u != 0.0 else 0.0
    if a >= p.band + p.edge:
        return u
    if a <= p.band - p.edge:
        return 0.0
    z = 0.5 * (a - p.band + p.edge) / p.edge
    return u * z * z * (3.0 - 2.0 * z)


class GainAsymmetrySettings(Settings):
    """a is the size."""

    term: Literal["drive.gain_asymmetry"] = "drive.gain_asymmetry"
    node: Node
    a: float = quantity(unit="", ge=-0.95, le=0.95, help="gain is 1 + a for positive commands and 1 - a for negative")


class GainAsymmetryParams(NamedTuple):
    a: float


def build_gain_asymmetry(settings: GainAsymmetrySettings, h: float) -> GainAsymmetryParams:
    """Nothing to discretise."""
    return GainAsymmetryParams(settings.a)


@tick
def gain_asymmetry(p, u):
    """Volts at the driver for a command of `u` volts."""
    return u + p.a * abs(u)


class SaturationSettings(Settings):
    """Without effect where limit is beyond what is commanded and rise is 0; knee alone has none."""

    term: Literal["drive.saturation"] = "drive.saturation"
    node: Node
    limit: float = quantity(unit="V", gt=0, le=1e3, help="largest output")
    knee: float = quantity(0.0, unit="", ge=0, le=0.9, help="rounding of the limit, as a share of it; 0 is sharp")
    rise: float = quantity(0.0, unit="s/V", ge=0, le=10, help="time of a change of one volt; 0: no limit")
    form: Literal["parabola", "rapp"] = Field(
        default="parabola", description="rounding: over the knee only, or at all sizes, u/(1 + (u/limit)^p)^(1/p)"
    )


class SaturationParams(NamedTuple):
    limit: float
    knee: float
    step: float  # V in one substep; 0 where there is no limit to it
    power: float  # of Rapp's form; 0 in the other


SATURATION_STATE = state(u=float)


def build_saturation(settings: SaturationSettings, h: float) -> SaturationParams:
    """Largest change in a substep of `h` s, and the power at which Rapp's form lacks a quarter of the knee at the
    limit, as the parabola does."""
    step = h / settings.rise if settings.rise > 0.0 else 0.0
    rapp = settings.form == "rapp" and settings.knee > 0.0
    return SaturationParams(settings.limit, settings.knee, step, 4.0 * math.log(2.0) / settings.knee if rapp else 0.0)


@tick
def saturation(p, s, u):
    """Mean volts at the driver over a substep at a command of `u` volts.

    A knee of its own, or the amplifier of C. Rapp, 2nd European Conference on Satellite Communications, 1991.
    """
    a = abs(u)
    low, high = p.limit * (1.0 - p.knee), p.limit * (1.0 + p.knee)
    if p.power > 0.0:
        small, large = min(a, p.limit), max(a, p.limit)
        a = small / (1.0 + (small / large) ** p.power) ** (1.0 / p.power)
    elif a >= high:
        a = p.limit
    elif a > low:
        a -= 0.5 * (a - low) ** 2 / (high - low)
    target = math.copysign(a, u)
    return ramp(s, target, p.step) if p.step > 0.0 else target


@tick
def ramp(s, u, step):
    """Mean of what goes to `u` volts by no more than `step` in a substep."""
    ahead = u - s.u
    if abs(ahead) > step:
        move = math.copysign(step, ahead)
        s.u += move
        return s.u - 0.5 * move
    s.u = u
    return u - 0.5 * ahead * abs(ahead) / step


class SupplySagSettings(Settings):
    """k is the size. current: they draw |volts|; power: their square; drawn: |volts| after the sag.

    A supply feeds all drives, or the one at the node alone.
    """

    term: Literal["drive.supply_sag"] = "drive.supply_sag"
    node: Node
    k: float = quantity(unit="", ge=0, le=1, help="share of gain lost per volt, or per volt squared, of all drives")
    form: Literal["current", "power", "drawn"] = Field(
        default="current", description="load of the supply: |volts|, their square, or |volts| after the sag"
    )
    tau: float = quantity(0.0, unit="s", ge=0, le=10, help="time constant of the supply's capacitor; 0: none")
    feeds: Literal["all", "own"] = Field(default="all", description="drives on the supply: all, or the one at the node")


class SupplySagParams(NamedTuple):
    k: float
    form: int
    share: float  # of the way to the load of now, a substep
    own: int  # 1: it feeds one drive


SUPPLY_SAG_STATE = state(load=float)


def build_supply_sag(settings: SupplySagSettings, h: float) -> SupplySagParams:
    """Exact step of the capacitor under a load that is held."""
    share = -math.expm1(-h / settings.tau) if settings.tau > 0.0 else 1.0
    return SupplySagParams(settings.k, SAG_FORMS.index(settings.form), share, FEEDS.index(settings.feeds))


@tick
def supply_sag(p, s, volts, c):
    """Lower the `volts` (n,) of all drives that the supply of drive `c` feeds by the sag of their common load."""
    load = 0.0
    first, behind = (c, c + 1) if p.own == 1 else (0, volts.shape[0])
    for i in range(first, behind):
        load += volts[i] * volts[i] if p.form == 1 else abs(volts[i])
    if p.form == 2:  # the load is that of the sagged volts: load' = (load0 (1 - k load) - load) / tau, exact
        more = 1.0 + p.k * load
        s.load += (1.0 - (1.0 - p.share) ** more) * (load / more - s.load)
    else:
        s.load += p.share * (load - s.load)
    gain = max(1.0 - p.k * s.load, 0.0)
    for i in range(first, behind):
        volts[i] *= gain


OFFSET = Term(
    name="drive.offset",
    remedies=("curve",),
    words="a push that is always there: the drive gives something when nothing is asked for",
    equation="u_out = u + offset",
    source="Krishnan 2001",
    settings=OffsetSettings,
    build=build_offset,
    act={"command": "{m}.volts[{c}] = drive.offset({p}, {m}.volts[{c}])"},
    stands=(stand("drive"),),
    look_alikes={
        "friction.asymmetry": "at two places or loads of different friction: an offset stays, asymmetry grows",
        "drive.gain_asymmetry": "command at one, two and three times the size: an offset does not grow with it",
        "drive.deadband": "commands of both signs: an offset shifts both the same way, a dead band towards zero",
        "load.spring": "the same short move at both ends of the travel: an offset is the same everywhere",
        "load.imbalance": "one slow turn: an offset is the same at every angle",
        "tape.viscoelastic": "hold one tension for a minute: an offset does not change in that time",
    },
    typical={"offset": (0.02, 0.2)},
    axis="command",
    order=20,
    passive=False,
    phrase=Phrase(
        noun="an offset",
        head="{here} pushes at zero command",
        detail="its output is off by {offset:+}",
        need="changes of command",
    ),
    check="Set the command to zero and measure the output of the amplifier; trim its zero.",
    search=(Size("offset", "volts", 0.05, signed=True, slight=0.05),),
    static=True,
    draws={"offset": Draw(0.05, 0.3, "volts", signed=True)},
)
DEADBAND = Term(
    name="drive.deadband",
    remedies=("curve",),
    words="a dead zone: small commands do nothing, the drive wakes up only beyond them",
    equation="u_out = sign(u) max(|u| - band, 0)",
    source="Slotine & Li 1991, 5.2",
    settings=DeadbandSettings,
    build=build_deadband,
    act={"command": "{m}.volts[{c}] = drive.deadband({p}, {m}.volts[{c}])"},
    stands=(stand("drive"),),
    look_alikes={
        "friction.coulomb": "move it by hand or by the other motor: friction is still there, a dead band is not",
        "drive.offset": "commands of both signs: a dead band lowers both outputs, an offset raises one of them",
        "friction.stribeck": "a constant speed under growing load: a dead band shows by command, sticking by speed",
        "transmission.backlash": "small fast commands of one sign: a dead band loses them, backlash needs a reversal",
    },
    typical={"band": (0.02, 0.2)},
    axis="command",
    order=20,
    phrase=Phrase(
        noun="a dead zone",
        head="{here} has a dead zone",
        detail="commands below {band} {form:words}",
        need="small commands of both signs",
        forms={"": "do nothing", "floor": "all give the same"},
    ),
    check="Raise the command slowly from zero and see where the output of the amplifier begins to follow.",
    search=(Size("band", "volts", 0.1), Choice("form", ("shift", "cut", "floor"))),
    variants=Choice("form", ("shift", "cut", "floor")),
    static=True,
    draws={"band": Draw(0.05, 0.3, "volts")},
    chosen={"form": ("shift", "cut", "floor")},
)
GAIN_ASYMMETRY = Term(
    name="drive.gain_asymmetry",
    remedies=("curve",),
    words="stronger one way than the other: the same command gives more in one direction",
    equation="u_out = (1 + a sign(u)) u",
    source="Krishnan 2001",
    settings=GainAsymmetrySettings,
    build=build_gain_asymmetry,
    act={"command": "{m}.volts[{c}] = drive.gain_asymmetry({p}, {m}.volts[{c}])"},
    stands=(stand("drive"),),
    look_alikes={
        "friction.asymmetry": "brake at speed: a gain follows the sign of the command, friction the sign of the speed",
        "drive.offset": "command at one, two and three times the size: a gain grows with it, an offset does not",
        "friction.load": "both signs of command at one tension: friction is the same for both, a gain is not",
    },
    typical={"a": (0.03, 0.2)},
    axis="command",
    order=20,
    passive=False,
    phrase=Phrase(
        noun="unequal gain",
        head="{here} is stronger one way",
        detail=("{a:%} {a:more|less} than commanded at positive commands and {a:%} {a:less|more} at negative ones"),
        need="commands of both signs",
    ),
    check=("Command the same size with either sign and measure both outputs; look for a weak half of the bridge."),
    search=(Size("a", "one", 0.1, signed=True),),
    static=True,
    draws={"a": Draw(0.03, 0.2, signed=True)},
)
SATURATION = Term(
    name="drive.saturation",
    remedies=("limits", "curve"),
    words="it runs out of push: beyond some command there is no more, or it cannot follow fast",
    equation="|u_out| <= limit, |u_out'| <= 1/rise; or u/(1 + (u/limit)^p)^(1/p)",
    source="Slotine & Li 1991, 5.2; Rapp 1991",
    settings=SaturationSettings,
    build=build_saturation,
    act={"command": "{m}.volts[{c}] = drive.saturation({p}, {s}, {m}.volts[{c}])"},
    stands=(stand("drive"),),
    look_alikes={
        "drive.supply_sag": "a hard push of one motor alone and of both: a limit does not depend on the other motor",
        "drive.lag": "small and large steps: a lag takes the same time for both, a limit changes the large",
        "transmission.slip": "hold the load still and push: a limit shows in the force, slip in lost travel",
        "friction.viscous": "hard acceleration from standstill: a limit shows at once, drag only at speed",
    },
    typical={"limit": (0.3, 0.9)},
    scale={"limit": "largest command"},
    axis="command",
    order=20,
    state=SATURATION_STATE,
    phrase=Phrase(
        noun="saturation",
        head="{here} saturates",
        detail="its output stops at {limit}",
        need="commands near the limit",
    ),
    check="Look at the current limit that is set in the amplifier and at the voltage of its supply.",
    search=(Limit("limit", "peak", (0.5, 0.8)),),
    richer=(Shape("knee", "one", (0.15,), 6.0),),
    variants=Choice("form", ("parabola", "rapp")),
    static=True,
    draws={"limit": Draw(0.6, 0.9, "peak")},
)
SUPPLY_SAG = Term(
    name="drive.supply_sag",
    remedies=("feedforward", "limits"),
    words="a weak supply: the more all motors draw, the less each of them gets",
    equation="u_out,i = u_i (1 - k sum_j |u_j|)",
    source="Krishnan 2001",
    settings=SupplySagSettings,
    build=build_supply_sag,
    act={"command": "drive.supply_sag({p}, {s}, {m}.volts, {c})"},
    stands=(
        stand("drive", "general several supply", ways=(SAG, (*SAG, Choice("feeds", ("own",))))),
        stand("drive", "general several", ways=((*SAG, Choice("feeds", ("own",))),)),  # one for all is at the first
        stand("drive", "supply"),
    ),
    look_alikes={
        "drive.saturation": "a hard push of one motor alone and of both: sag depends on what the other motor draws",
        "drive.thermal": "the same burst cold and after a minute: sag shows from the first moment",
        "friction.viscous": "hold the load still and command more: sag shows without speed",
        "friction.load": "load the other motor at constant tension: sag changes the gain, friction stays",
    },
    typical={"k": (0.01, 0.08)},
    axis="command",
    order=20,
    state=SUPPLY_SAG_STATE,
    phrase=Phrase(
        noun="a weak supply",
        head="the supply of {here} sags",
        detail="{k:%} is lost for each {form:words} of all drives together",
        need="hard work of all drives at once",
        forms={"": "{command}", "power": "{command} squared"},
    ),
    check=(
        "Measure the supply at the terminals of the drives while all of them work hard; look at its "
        "cables and its rating."
    ),
    units={"k": "1/V"},
    search=SAG,
    richer=(Shape("tau", "seconds", (0.02,), 30.0),),
    variants=Choice("form", ("current", "power", "drawn")),
    draws={"k": Draw(0.03, 0.15, "per_volt")},
)
