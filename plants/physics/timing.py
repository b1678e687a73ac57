"""Timing: delay beyond the nominal delay of the loop, and jitter of the ticks.

Source: Astrom & Wittenmark, Computer-Controlled Systems (1997), 2.3 and 3.5 for a delay that is no whole sample;
Cervin et al., How does control timing affect performance, IEEE Control Systems 23(3) (2003) for jitter.
"""

import math
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from rtctl.config.errors import UserError
from rtctl.counted import uniform
from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants import ivu, ldu, linear
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Size
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term

LENGTH = 1024  # substeps that the line holds
LONGEST = 0.03  # s
CHANNELS = linear.MOST_DRIVES
JITTER_FORMS = ("gaussian", "uniform")


class DelaySettings(Settings):
    """extra is the size."""

    term: Literal["timing.delay"] = "timing.delay"
    node: Node
    extra: float = quantity(unit="s", ge=0, le=LONGEST, help="delay on top of the known delay of the loop")


class DelayParams(NamedTuple):
    whole: int  # substeps
    part: float


DELAY_STATE = state(n=int, line=(float, (CHANNELS, LENGTH)))


def build_delay(settings: DelaySettings, h: float) -> DelayParams:
    """Whole substeps of `h` s and a part of one. Raises UserError where the substeps are too short for the line."""
    extra = min(max(settings.extra, 0.0), LONGEST)  # a fit may ask for more
    whole = math.floor(extra / h)
    if whole > LENGTH - 2:
        raise UserError(
            f"timing.delay: {extra * 1e3:g} ms is {extra / h:.0f} substeps of {h * 1e6:g} us and {LENGTH - 2} is the "
            f"most; make plant.substep {extra / (LENGTH - 2) * 1e6:.3g} us or longer"
        )
    return DelayParams(whole, extra / h - whole)


@tick
def delay(p, s, volts):
    """Replace all `volts` (n,) by the delayed volts.

    Volts are held over a substep, so the mean over a delayed substep is a weighted mean of two neighbours: exact for
    any delay.
    """
    now = s.n % LENGTH
    one, two = (s.n - p.whole) % LENGTH, (s.n - p.whole - 1) % LENGTH
    for c in range(volts.shape[0]):
        s.line[c, now] = volts[c]
        volts[c] = (1.0 - p.part) * s.line[c, one] + p.part * s.line[c, two]
    s.n += 1


class JitterSettings(Settings):
    """sigma is the size. The reading is taken up to half a period early or late, at random with a fixed seed."""

    term: Literal["timing.jitter"] = "timing.jitter"
    node: Node
    sigma: float = quantity(unit="s", ge=0, le=0.01, help="standard deviation of the time of a tick")
    rate: float = quantity(500.0, unit="1/s", gt=0, le=1e5, help="ticks a second")
    seed: int = Field(default=1, description="seed of the random times; an equal seed gives equal times")
    form: Literal["gaussian", "uniform"] = Field(default="gaussian", description="distribution of the times")


class JitterParams(NamedTuple):
    sigma: float
    rate: float
    seed: int
    form: int


def build_jitter(settings: JitterSettings, h: float) -> JitterParams:
    """Nothing to discretise."""
    return JitterParams(settings.sigma, settings.rate, settings.seed, JITTER_FORMS.index(settings.form))


@tick
def late(p, t):
    """Delay of the tick nearest to time `t` (s), s; the tick at 0 is on time."""
    k = math.floor(t * p.rate + 0.5)
    if k == 0:
        return 0.0
    z = np.uint64(p.seed) * np.uint64(0xD1342543DE82EF95) + np.uint64(k) * np.uint64(0x9E3779B97F4A7C15)
    one, two = uniform(z), uniform(z + np.uint64(0x632BE59BD9B4E019))
    if p.form == 0:  # Box & Muller 1958
        x = math.sqrt(-2.0 * math.log(one)) * math.cos(2.0 * math.pi * two)
    else:
        x = math.sqrt(12.0) * (one - 0.5)
    half = 0.5 / p.rate
    return min(max(p.sigma * x, -half), half)


@tick
def jitter(p, m):
    """Move the readings of all positions of a described machine to their true sampling time."""
    delta = late(p, m.t)
    for c in range(m.ny):
        m.y[c] += m.y_rate[c] * delta


@tick
def jitter_ivu(p, m):
    """Move the readings of capstan and reels to their true sampling time."""
    delta = late(p, m.t)
    m.y[0] += m.x[ivu.NQ + ivu.CAPSTAN] * delta
    m.y[1] += m.x[ivu.NQ + ivu.REEL1] * delta
    m.y[2] += m.x[ivu.NQ + ivu.REEL2] * delta


@tick
def jitter_ldu(p, m, r):
    """Move the readings of encoder and scale to their true sampling time; `r` is the radius of the capstan."""
    delta = late(p, m.t)
    m.y[0] += m.x[ldu.NQ + ldu.ENCODER] * delta
    m.y[1] += r * m.x[ldu.NQ + ldu.CAPSTAN] * delta


@tick
def jitter_axis(p, m):
    """Move the reading of the axis to its true sampling time."""
    m.y[0] += m.x[1] * late(p, m.t)


DELAY = Term(
    name="timing.delay",
    remedies=("lead", "delay"),
    words="it acts late: what the controller writes reaches the motor later than it is said to",
    equation="u_out(t) = u(t - extra)",
    source="Astrom & Wittenmark 1997, 2.3",
    settings=DelaySettings,
    build=build_delay,
    act={"command": "timing.delay({p}, {s}, {m}.volts)"},
    stands=(stand("loop"),),
    look_alikes={
        "drive.lag": "a sweep up to half the sample rate: a delay only turns the phase, a lag weakens it too",
        "structure.resonance": "a sweep: a delay leaves the gain as it is",
        "friction.presliding": "tiny and large motions: a delay turns the phase of both alike",
        "tape.viscoelastic": "one motor with the tape off: a delay stays",
        "transmission.backlash": "small and large reversals: a delay is a constant time, backlash a constant distance",
    },
    typical={"extra": (0.3, 3.0)},
    scale={"extra": "sample period"},
    axis="frequency",
    order=10,
    state=DELAY_STATE,
    phrase=Phrase(
        noun="extra delay",
        head="{here} acts late",
        detail="commands take effect {extra} later than stated",
        need="quick changes of the command",
    ),
    check=(
        "Look for a filter, a bus or a buffer between the command and the amplifier, and count the "
        "ticks that each of them holds."
    ),
    search=(Size("extra", "tick", 0.5, blur="driver"),),
    draws={"extra": Draw(0.3, 1.5, "tick")},
)
JITTER = Term(
    name="timing.jitter",
    remedies=("observer",),
    words="an unsteady clock: readings are taken a little early or late, which shows when it moves fast",
    equation="y_k = y(t_k + delta_k), delta_k of standard deviation sigma",
    source="Cervin et al. 2003",
    settings=JitterSettings,
    build=build_jitter,
    act={
        "reading": "timing.jitter({p}, {m})",
        "reading:ivu": "timing.jitter_ivu({p}, {m})",
        "reading:ldu": "timing.jitter_ldu({p}, {m}, {r})",
        "reading:axis": "timing.jitter_axis({p}, {m})",
    },
    stands=(stand("loop"),),
    look_alikes={
        "ripple.encoder": "two constant speeds: jitter grows with speed and has no angle, ripple stays on its angle",
        "sensor.missed_counts": "there and back: jitter leaves nothing, lost counts stay lost",
    },
    typical={"sigma": (0.05, 0.3)},
    scale={"sigma": "sample period"},
    axis="velocity",
    order=10,
    phrase=Phrase(
        noun="an unsteady clock",
        head="the clock of {here} is unsteady",
        detail="ticks are off by {sigma} rms",
        need="fast motion",
    ),
    check="Look at what else runs on the computer of the controller and at the priority of its loop.",
    clock=True,
    draws={"sigma": Draw(0.05, 0.3, "tick"), "rate": Draw(1.0, 1.0, "hertz")},
    chosen={"form": ("gaussian", "uniform")},
)
