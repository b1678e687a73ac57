"""Tape: viscoelastic relaxation parallel to the linear spring and damper, and slack.

A Maxwell branch is a spring c_branch in series with a dashpot of c_branch tau, parallel to the tape's own spring:

    T_b = c_branch (e - z),  z' = (e - z) / tau

z is the elongation of the dashpot. For an elongation that changes linearly over a substep the step is exact for any
tau; the pull is the mean over the substep. The stiffness is c for slow loads and c + c_branch for fast loads.

Source: Ferry, Viscoelastic properties of polymers (1980), ch. 1, generalised Maxwell body; Shelton, Dynamics of web
tension control with velocity or torque control (1986), for tape and slack.
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants import linear
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Choice, Shape, Size
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term


class ViscoelasticSettings(Settings):
    """c_branch and c_branch2 are the sizes."""

    term: Literal["tape.viscoelastic"] = "tape.viscoelastic"
    node: Node
    c_branch: float = quantity(unit="N/m", ge=0, le=1e6, help="stiffness that relaxes")
    tau: float = quantity(unit="s", gt=0, le=1e4, help="time constant of the relaxation")
    c_branch2: float = quantity(0.0, unit="N/m", ge=0, le=1e6, help="stiffness of a second branch")
    tau2: float = quantity(1.0, unit="s", gt=0, le=1e4, help="time constant of the second branch")


class ViscoelasticParams(NamedTuple):
    c_branch: float
    end: float  # decay of the spring's elongation y over a substep: y+ = end y + gain e'
    mean: float  # over the substep: y = mean y + mean_gain e'
    mean_gain: float
    rate: float  # h / tau
    half: float  # h / 2
    c_branch2: float
    end2: float
    mean2: float
    mean_gain2: float
    rate2: float


VISCOELASTIC_STATE = state(z=float, z2=float)


def build_viscoelastic(settings: ViscoelasticSettings, h: float) -> ViscoelasticParams:
    """Exact step of both branches over `h` s."""
    one, two = branch(settings.tau, h), branch(settings.tau2, h)
    return ViscoelasticParams(settings.c_branch, *one, 0.5 * h, settings.c_branch2, *two)


def branch(tau: float, h: float) -> tuple[float, float, float, float]:
    """Factors (end, mean, mean_gain, rate) of y' = e' - y / tau over `h` s."""
    x = h / tau
    end = math.exp(-x)
    mean = -math.expm1(-x) / x
    return end, mean, tau * (1.0 - mean), x


@tick
def viscoelastic(p, s, e, rate):
    """Pull of the branches at elongation `e` m growing by `rate` m/s at the middle of the substep, N."""
    start = e - p.half * rate
    y = p.mean * (start - s.z) + p.mean_gain * rate
    y2 = p.mean2 * (start - s.z2) + p.mean_gain2 * rate
    s.z += p.rate * y
    s.z2 += p.rate2 * y2
    return p.c_branch * y + p.c_branch2 * y2


class SlackSettings(Settings):
    """share is the size: at 0 the tape pushes as a rod would."""

    term: Literal["tape.slack"] = "tape.slack"
    node: Node
    share: float = quantity(1.0, unit="", ge=0, le=1, help="share of the push that is missing; 1: the tape cannot push")
    other: float = quantity(1.0, unit="", ge=0, le=1, help="factor of share on the other side of the capstan: one tape")


class SlackParams(NamedTuple):
    share: float
    other: float


def build_slack(settings: SlackSettings, h: float) -> SlackParams:
    """Nothing to discretise."""
    return SlackParams(settings.share, settings.share * settings.other)


@tick
def slack(share, T):
    """Pull in N that cancels a negative tension `T` of the linear model."""
    return share * max(-T, 0.0)


@tick
def let_go(p, m, j, k):
    """Cancel the negative tension of tape `j`, and of the tape `k` on the other side where there is one."""
    linear.pull(m, j, slack(p.share, linear.tension(m, j)))
    if k >= 0:
        linear.pull(m, k, slack(p.other, linear.tension(m, k)))


VISCOELASTIC = Term(
    name="tape.viscoelastic",
    remedies=("joint",),
    words="the tape gives way slowly: held taut it relaxes, let go it comes back late",
    equation="T_b = c_branch (e - z), z' = (e - z) / tau",
    source="Ferry 1980",
    settings=ViscoelasticSettings,
    build=build_viscoelastic,
    act={
        "force": "linear.pull({m}, {l}, tape.viscoelastic({p}, {s}, linear.stretch({m}, {l}), "
        "linear.stretch_rate({m}, {l})))"
    },
    stands=(stand("joint", "spring span"),),
    look_alikes={
        "transmission.creep": "hold tension at standstill: creep needs travel, relaxation only time",
        "friction.presliding": "hold and wait: bristles stay where they are, a relaxing tape moves on",
        "timing.delay": "a slow sweep: a delay does nothing at a tenth of a hertz, relaxation does",
        "drive.offset": "hold one tension for a minute: an offset does not change in that time",
    },
    typical={"c_branch": (0.3, 1.5), "tau": (0.01, 1.0)},
    scale={"c_branch": "stiffness"},
    axis="frequency",
    order=90,
    state=VISCOELASTIC_STATE,
    phrase=Phrase(
        noun="slow relaxation",
        head="{here} yields slowly",
        detail="a stiffness of {c_branch} relaxes within {tau}",
        need="changes of tension",
    ),
    check="Hang a weight on the tape and see whether it still gives after a minute; look at its material.",
    search=(Size("c_branch", "stiffness", 0.5), Shape("tau", "seconds", (0.01, 0.05, 0.25, 1.2))),
    richer=(Size("c_branch2", "stiffness", 0.2), Shape("tau2", "seconds", (0.5,), 60.0)),
    stiff=True,
)
SLACK = Term(
    name="tape.slack",
    remedies=("tension", "limits"),
    words="slack: the tape pulls and cannot push",
    equation="T = max(0, c e + k e')",
    source="Shelton 1986",
    settings=SlackSettings,
    build=build_slack,
    act={
        "force": "tape.let_go({p}, {m}, {l}, 1 - {l})",
        "force:described": "tape.let_go({p}, {m}, {l}, {k})",
    },
    stands=(stand("joint", "spring span"),),
    look_alikes={
        "transmission.backlash": "the same moves at a higher tension: the tape stays taut, backlash stays",
        "transmission.slip": "the same moves at a higher tension: both disappear, but slip leaves lost travel",
    },
    axis="tension",
    order=90,
    phrase=Phrase(
        noun="slack",
        head="{here} goes slack",
        detail="it pulls and cannot push",
        need="moments of low tension",
    ),
    check="Watch the tape in quick reversals and see whether it hangs through; look at its pretension.",
    search=(Choice("share", (1.0,)), Choice("other", (1.0, 0.0))),
    stiff=True,
    draws={"share": Draw(0.8, 1.0)},
)
