"""Sensors: lost counts, a sensor without direction, and an error of scale.

State is updated at the force site, once a substep; the reading only uses the state, so that a reading may be computed
at any time.

Source: Heidenhain, Encoders for servo drives (2023), signal errors; thesis 7.1.1 and 7.1.3 for counters and the optical
sensors of the reels; thesis 11.2 for the radius that is 1.8 um off.
"""

import math
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Choice, Jumps, Size
from rtctl.plants.physics.story import BOTH, Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term

MOST = 48  # jumps
WAYS = {"forward": 1, "backward": -1}


class MissedCountsSettings(Settings):
    """size and each are the sizes; rad or m as the sensor reads. A loss forwards is negative."""

    term: Literal["sensor.missed_counts"] = "sensor.missed_counts"
    node: Node
    at: float = quantity(0.0, unit="s", ge=0, le=1e9, help="time of the jump")
    size: float = quantity(0.0, unit="", ge=-100, le=100, help="jump of the reading, rad or m")
    more: tuple[tuple[float, float], ...] = Field(
        default=(), description="time of each further jump (s), and its size over that of the first"
    )
    over: float = quantity(1e-3, unit="s", gt=0, le=10, help="time that a jump takes")
    each: float = quantity(0.0, unit="", ge=-10, le=10, help="jump at each passage of the mark, rad or m")
    way: Literal["forward", "backward"] = Field(default="forward", description="direction in which the mark is passed")
    mark: float = quantity(0.0, unit="", ge=-100, le=100, help="position of the mark, rad or m")
    turn: float = quantity(2.0 * math.pi, unit="", gt=0, le=1e3, help="travel from mark to mark, rad or m")

    @model_validator(mode="after")
    def _fits(self) -> "MissedCountsSettings":
        if len(self.more) >= MOST:
            raise ValueError(f"more: {len(self.more)} further jumps are too many; use at most {MOST - 1}")
        return self


class MissedCountsParams(NamedTuple):
    at: np.ndarray  # (MOST,) s
    size: np.ndarray  # (MOST,)
    n: int
    per_s: float  # 1 / over
    each: float
    way: int
    mark: float
    turn: float
    start: float  # marks below position 0


MISSED_COUNTS_STATE = state(marks=float, passed=float)


def build_missed_counts(settings: MissedCountsSettings, h: float) -> MissedCountsParams:
    """Jumps as arrays of fixed length."""
    at, size = np.zeros(MOST), np.zeros(MOST)
    jumps = ((settings.at, 1.0), *settings.more)[:MOST]
    for k, (when, what) in enumerate(jumps):
        at[k], size[k] = when, what * settings.size
    start = math.floor(-settings.mark / settings.turn)
    return MissedCountsParams(
        at,
        size,
        len(jumps),
        1.0 / settings.over,
        settings.each,
        WAYS[settings.way],
        settings.mark,
        settings.turn,
        start,
    )


@tick
def pass_marks(p, s, x):
    """Count the passages of a mark on the way to position `x` of the sensor, rad or m."""
    marks = math.floor((x - p.mark) / p.turn) - p.start
    s.passed += max(p.way * (marks - s.marks), 0.0)
    s.marks = marks


@tick
def missed_counts(p, s, x, t):
    """Error of the reading at time `t` and position `x`."""
    off = 0.0
    for k in range(p.n):
        off += p.size[k] * min(max((t - p.at[k]) * p.per_s, 0.0), 1.0)
    if p.each != 0.0:
        marks = math.floor((x - p.mark) / p.turn) - p.start
        off += p.each * (s.passed + max(p.way * (marks - s.marks), 0.0))
    return off


class RectifiedSettings(Settings):
    """share is the size: 1 counts up in either direction, 0 knows the direction."""

    term: Literal["sensor.rectified"] = "sensor.rectified"
    node: Node
    share: float = quantity(1.0, unit="", ge=0, le=1, help="1: direction unknown; less: it is sometimes right")


class RectifiedParams(NamedTuple):
    share: float


RECTIFIED_STATE = state(x=float, way=float)


def build_rectified(settings: RectifiedSettings, h: float) -> RectifiedParams:
    """Nothing to discretise; a reversal within a substep is not seen."""
    return RectifiedParams(settings.share)


@tick
def go(s, x):
    """Add the travel to position `x` of the sensor, rad or m."""
    s.way += abs(x - s.x)
    s.x = x


@tick
def rectified(p, s, x, y, speed):
    """Error of the reading `y` at position `x`, rad or m; `speed` is 1 for a reading of speed, which has no memory."""
    if speed != 0:
        return p.share * (abs(y) - y)
    return p.share * (s.way + abs(x - s.x) - x)


class ScaleSettings(Settings):
    """relative is the size."""

    term: Literal["sensor.scale"] = "sensor.scale"
    node: Node
    relative: float = quantity(unit="", ge=-0.9, le=10, help="share by which the reading is too large")


class ScaleParams(NamedTuple):
    relative: float


def build_scale(settings: ScaleSettings, h: float) -> ScaleParams:
    """Nothing to discretise."""
    return ScaleParams(settings.relative)


@tick
def scale(p, y):
    """Reading for a true value of `y`."""
    return y * (1.0 + p.relative)


X = {"": "{r} * {m}.x[{i}]", ":ivu": "{m}.x[ivu.CAPSTAN]"}  # position at the sensor; the IVU's encoder is no node
READING = "{m}.y[{c}], {m}.y_speed[{c}]"
MISSED_COUNTS = Term(
    name="sensor.missed_counts",
    remedies=("sensor",),
    words="counts get lost: the reading jumps and the jump stays",
    equation="y = x + size times the sum of share_k after at_k, or x + each times the passages of a mark",
    source="Heidenhain 2023; thesis 7.1.1",
    settings=MissedCountsSettings,
    build=build_missed_counts,
    act={
        **{f"force{kind}": f"sensor.pass_marks({{p}}, {{s}}, {x})" for kind, x in X.items()},
        **{
            f"reading{kind}": f"{{m}}.y[{{c}}] += sensor.missed_counts({{p}}, {{s}}, {x}, {{m}}.t)"
            for kind, x in X.items()
        },
    },
    stands=(stand("sensor", "position"),),
    look_alikes={
        "transmission.slip": "drive to a hard stop and back: slip comes with force, lost counts do not",
        "load.bump": "pass the place ten times: a bump comes back to zero error, lost counts add up",
        "guide.dirt": "pass the place ten times: dirt comes back to zero error, lost counts add up",
        "sensor.scale": "there and back: a scale error comes back to zero, lost counts stay",
        "transmission.creep": "there and back slowly: lost counts come in jumps, creep steadily",
        "sensor.rectified": "one slow move out and back: lost counts jump, a rectified reading turns over smoothly",
        "timing.jitter": "there and back: jitter leaves nothing, lost counts stay lost",
    },
    typical={"size": (3e-3, 6e-2)},
    axis="time",
    order=170,
    state=MISSED_COUNTS_STATE,
    phrase=Phrase(
        noun="lost counts",
        head="{here} loses counts",
        detail="{jumps:words}",
        need="fast motion and a return to a known place",
    ),
    check="Look at the screen and the plug of the cable of the sensor, and at its highest count rate.",
    units={"at": "s"},
    search=(Jumps("size"),),
    draws={"each": Draw(0.003, 0.03, "lever", signed=True), "mark": Draw(0.02, 0.08, "travel"), "size": Draw(0.0, 0.0)},
)
RECTIFIED = Term(
    name="sensor.rectified",
    remedies=("sensor",),
    words="it cannot tell direction: it counts up on the way out and on the way back",
    equation="y = integral of |x'| dt; of a sensor of speed y = |v|",
    source="thesis 7.1.3",
    settings=RectifiedSettings,
    build=build_rectified,
    act={
        **{f"force{kind}": f"sensor.go({{s}}, {x})" for kind, x in X.items()},
        **{
            f"reading{kind}": f"{{m}}.y[{{c}}] += sensor.rectified({{p}}, {{s}}, {x}, {READING})"
            for kind, x in X.items()
        },
    },
    stands=(
        stand("sensor", "position"),
        stand("sensor", "speed"),
    ),
    look_alikes={
        "sensor.scale": "one move out and back: a scale error ends at zero, a rectified reading at twice the way",
        "sensor.missed_counts": "one slow move out and back: lost counts jump, a rectified reading turns over smoothly",
    },
    typical={"share": (0.5, 1.0)},
    axis="velocity",
    shown="to and fro",
    order=170,
    state=RECTIFIED_STATE,
    phrase=Phrase(
        noun="a sensor without direction",
        head="{here} cannot tell direction",
        detail="{share:%} of the backward motion counts as forward motion",
        need=BOTH,
    ),
    check=(
        "Move it by hand there and back and see whether the reading comes back; look at the second "
        "channel of the sensor."
    ),
    needs=Needs(compared=True, alone="unsigned"),
    search=(Choice("share", (1.0,)),),
    unsigned=True,
    draws={"share": Draw(0.5, 1.0)},
)
SCALE = Term(
    name="sensor.scale",
    remedies=("table",),
    words="a wrong factor: every distance reads too long or too short by the same share",
    equation="y = (1 + relative) x",
    source="thesis 11.2",
    settings=ScaleSettings,
    build=build_scale,
    act={"reading": "{m}.y[{c}] = sensor.scale({p}, {m}.y[{c}])"},
    stands=(
        stand("sensor", "position"),
        stand("sensor", "speed"),
    ),
    look_alikes={
        "transmission.creep": "the same travel at two loads: creep grows with the load, a scale error does not",
        "transmission.slip": "the same travel hard and gently: slip comes with force, a scale error always",
        "sensor.missed_counts": "there and back: a scale error comes back to zero, lost counts stay",
        "sensor.rectified": "one move out and back: a scale error ends at zero, a rectified reading at twice the way",
        "guide.thickness": "travel over several wavelengths: a scale error grows with distance, waves do not",
        "guide.strip": "look for waves on top of the trend: a scale error has none",
        "geometry.radius_change": "two turns forth and two more: the factor stays, a growing reel errs with the square",
    },
    typical={"relative": (1e-4, 5e-3)},
    axis="position",
    order=170,
    phrase=Phrase(
        noun="a wrong scale factor",
        head="{here} has a wrong scale factor",
        detail="every distance reads {relative:%} too {relative:long|short}",
        need="a second sensor to compare with",
    ),
    check=("Move by a known length and compare the reading; look at the counts per turn and the radius that were set."),
    needs=Needs(
        compared=True,
    ),
    search=(Size("relative", "one", 0.001, signed=True),),
    draws={"relative": Draw(0.001, 0.005, signed=True)},
)
