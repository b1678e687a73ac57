"""Sliding of friction contacts: gross slip beyond a limit, and creep, the micro-slip that any rolling contact has.

The tape lies on the capstan of the IVU, whose contact carries the difference of the two tensions. The motor shaft of
the LDU rolls on the transmission wheel, and its capstan on the strip. The sliding distance d is an offset in the
elongation of the adjacent links:

    slip    |T - c d - k d'| <= F_max,  d' against it              T - c d - k d' = +-F_max + eta d' while it slides
    creep   d' = (kappa |v| + rate) (T - c d - k d')               the thesis's chapters 11.2 and 12.5

with T the pull of the linear model, c and k of the links that share the contact, and v the speed of the surface. At a
joint of a described machine v is the speed of its far end. `rate` is creep at standstill, as of a belt or a clamped
hub. Slip and creep are linear in d over a substep and are stepped by their exponential: exact for a constant T, any
stiffness, no limit on h. Force times d' is never negative: sliding only dissipates energy.

The contact of capstan and strip is rigid in the LDU's model: the carriage, which the scale measures, falls behind
R_c theta_c by the sliding distance. Slip keeps the momentum: F_max acts on the carriage while the capstan runs ahead.

Source: thesis 11.2 and 12.5; Perzyna, Fundamental problems in viscoplasticity (1966), for the sliding speed in
proportion to the force beyond the limit; Kalker, Three-dimensional elastic bodies in rolling contact (1990), ch. 1;
Shelton, Dynamics of web tension control, for tape on a roller.
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants import linear
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Limit, Size
from rtctl.plants.physics.story import BEHIND, Draw, Phrase
from rtctl.plants.physics.term import Node, Term
from rtctl.plants.physics.transmission import undone

STRIP = "capstan"  # node of the LDU whose contact is rigid
BY_WAY = (Size("kappa", "compliance", 0.001),)
LINK1, LINK2 = 1, 2  # of the LDU: the halves of its capstan, before and behind the strip


class SlipSettings(Settings):
    """Without effect while F_max exceeds the force of the contact; the size is 1 / F_max."""

    term: Literal["transmission.slip"] = "transmission.slip"
    node: Node
    F_max: float = quantity(unit="", gt=0, le=1e6, help="largest force of the contact, N (Nm of the motor at a wheel)")
    eta: float = quantity(
        0.0, unit="", ge=0, le=1e9, help="force beyond F_max per sliding speed, N s/m (Nm s/rad at a wheel)"
    )
    R_c: float = quantity(3e-3, unit="m", gt=0, help="radius of the LDU's capstan, where the strip slips")


class CreepSettings(Settings):
    """kappa and rate are the sizes."""

    term: Literal["transmission.creep"] = "transmission.creep"
    node: Node
    kappa: float = quantity(
        0.0, unit="", ge=0, le=1e3, help="share of travel lost per force, 1/N (1/Nm of the motor at a wheel)"
    )
    R_c: float = quantity(3e-3, unit="m", gt=0, help="radius of the LDU's capstan, where the strip creeps")
    rate: float = quantity(
        0.0, unit="", ge=0, le=1e6, help="travel lost per second and force, at a joint of a described machine"
    )


class SlipParams(NamedTuple):
    h: float
    F_max: float
    eta: float
    R_c: float
    strip: int


class CreepParams(NamedTuple):
    h: float
    kappa: float
    R_c: float
    strip: int
    rate: float


CONTACT_STATE = state(d=float, fallen=float, rate=float)  # offset in the links; of the carriage, m and m/s


def build_slip(settings: SlipSettings, h: float) -> SlipParams:
    """Params with the substep; the exponential is computed in the tick, since the links may change."""
    return SlipParams(h, settings.F_max, settings.eta, settings.R_c, int(settings.node == STRIP))


def build_creep(settings: CreepSettings, h: float) -> CreepParams:
    """As `build_slip`."""
    return CreepParams(h, settings.kappa, settings.R_c, int(settings.node == STRIP), settings.rate)


@tick
def slide(s, F_max, eta, T, c, k, h):
    """Slip where `T` less c times the sliding distance exceeds the limit; the mean change of the contact force, 0 or
    against T."""
    held = T - c * s.d
    if abs(held) <= F_max:
        return -c * s.d
    limit = math.copysign(F_max, held)
    end, before = (T - limit) / c, s.d
    s.d = end + (before - end) * (math.exp(-h * c / (k + eta)) if k + eta > 0.0 else 0.0)
    return limit + eta * (s.d - before) / h - T


@tick
def micro(s, grip, T, c, k, h):
    """Creep at `grip` = kappa |v|; the mean change of the contact force over the substep."""
    end = T / c
    before = s.d
    s.d = end + (before - end) * math.exp(-h * grip * c / (1.0 + grip * k))
    middle = end + (before - end) * math.exp(-0.5 * h * grip * c / (1.0 + grip * k))
    return -c * middle - k * (s.d - before) / h


@tick
def share(m, d, v, change):
    """Distribute a change of T2 - T1 over the two tapes by their stiffness; both have slid by `d` at the rate `v`."""
    both = m.link_c[0] + m.link_c[1]
    linear.slid(m, 1, d, v, change * m.link_c[1] / both)
    linear.slid(m, 0, -d, -v, -change * m.link_c[0] / both)


@tick
def slip_tape(p, s, m):
    """Slip of the tape on the capstan of the IVU."""
    T = linear.tension(m, 1) - linear.tension(m, 0)
    before = s.d
    change = slide(s, p.F_max, p.eta, T, m.link_c[0] + m.link_c[1], m.link_k[0] + m.link_k[1], p.h)
    share(m, s.d, (s.d - before) / p.h, change)


@tick
def creep_tape(p, s, m, i):
    """Creep of the tape on the capstan, node `i` of the IVU."""
    grip = p.kappa * abs(m.link_b[1] * m.vm[i])
    T = linear.tension(m, 1) - linear.tension(m, 0)
    before = s.d
    change = micro(s, grip, T, m.link_c[0] + m.link_c[1], m.link_k[0] + m.link_k[1], p.h)
    share(m, s.d, (s.d - before) / p.h, change)


@tick
def slip_joint(p, s, m, j):
    """Slip in link `j`."""
    T = undone(m, j)
    before = s.d
    change = slide(s, p.F_max, p.eta, T, m.link_c[j], m.link_k[j], p.h)
    linear.slid(m, j, s.d, (s.d - before) / p.h, change)


@tick
def creep_joint(p, s, m, j):
    """Creep in link `j`, with the motion of its far end and with time."""
    grip = p.kappa * abs(m.link_a[j] * m.vm[m.link_i[j]]) + p.rate
    before = s.d
    change = micro(s, grip, linear.tension(m, j), m.link_c[j], m.link_k[j], p.h)
    linear.slid(m, j, s.d, (s.d - before) / p.h, change)


@tick
def strip_force(p, m):
    """Contact force between strip and capstan of the LDU, N."""
    return (linear.tension(m, LINK1) - linear.tension(m, LINK2)) / p.R_c


@tick
def fall_behind(p, s, gain, force):
    """Slip behind a rigid contact that carries F_max at most; a newton adds the speed `gain` to the carriage."""
    gain /= 1.0 + gain * p.eta
    free = s.rate + gain * (force - p.eta * s.rate)
    rate = free + gain * linear.dry_friction(s.rate, free, gain, p.F_max)
    if abs(rate) < 1e-12 * abs(free):  # rounding of a stop
        rate = 0.0
    s.fallen += 0.5 * p.h * (s.rate + rate)
    s.rate = rate


@tick
def slip_wheel(p, s, m, i, j):
    """Slip in link `j` of the LDU, or of node `i`, its capstan, on the strip."""
    if p.strip == 0:
        linear.pull(m, j, slide(s, p.F_max, p.eta, undone(m, j), m.link_c[j], m.link_k[j], p.h))
        return
    gain = p.h * m.G[m.nq + i, m.nu + i] * p.R_c * p.R_c  # speed that a newton gives the carriage
    fall_behind(p, s, gain, strip_force(p, m))


@tick
def creep_wheel(p, s, m, i, j):
    """Creep in link `j` of the LDU, or of node `i`, its capstan, on the strip."""
    if p.strip == 0:
        grip = p.kappa * abs(m.link_a[j] * m.vm[m.link_i[j]])
        linear.pull(m, j, micro(s, grip, linear.tension(m, j), m.link_c[j], m.link_k[j], p.h))
        return
    s.fallen += p.h * p.kappa * strip_force(p, m) * abs(p.R_c * m.vm[i])


@tick
def share_spans(m, i, j, k, d, v, change):
    """As `share`, over the spans `j` and `k` that lie around coordinate `i`."""
    both = m.link_c[j] + m.link_c[k]
    for n in (j, k):
        way = linear.side(m, n, i)
        linear.slid(m, n, way * d, way * v, way * change * m.link_c[n] / both)


@tick
def carried(m, i, r):
    """Force in N of the links that end at coordinate `i`, at the lever `r` of its contact."""
    torque = 0.0
    for j in range(m.nl):
        if m.link_i[j] == i:
            torque -= m.link_a[j] * linear.tension(m, j)
        if m.link_j[j] == i:
            torque -= m.link_b[j] * linear.tension(m, j)
    return torque / r


@tick
def slip(p, s, m, i, r, j, k):
    """Slip of a contact: of coordinate `i` in the spans `j` and `k` around it, in link `j`, or, without a link, of a
    rigid contact at the lever `r`."""
    if k >= 0:
        T = linear.side(m, j, i) * linear.tension(m, j) + linear.side(m, k, i) * linear.tension(m, k)
        before = s.d
        change = slide(s, p.F_max, p.eta, T, m.link_c[j] + m.link_c[k], m.link_k[j] + m.link_k[k], p.h)
        share_spans(m, i, j, k, s.d, (s.d - before) / p.h, change)
    elif j >= 0:
        slip_joint(p, s, m, j)
    else:
        gain = p.h * m.G[m.nq + i, m.nu + i] * r * r  # speed that a newton adds at the contact
        fall_behind(p, s, gain, carried(m, i, r))


@tick
def creep(p, s, m, i, r, j, k):
    """Creep of a contact, with the cases of `slip`."""
    if k >= 0:
        arm = m.link_a[k] if m.link_i[k] == i else m.link_b[k]
        T = linear.side(m, j, i) * linear.tension(m, j) + linear.side(m, k, i) * linear.tension(m, k)
        before = s.d
        grip = p.kappa * abs(arm * m.vm[i])
        change = micro(s, grip, T, m.link_c[j] + m.link_c[k], m.link_k[j] + m.link_k[k], p.h)
        share_spans(m, i, j, k, s.d, (s.d - before) / p.h, change)
    elif j >= 0:
        creep_joint(p, s, m, j)
    else:
        s.fallen += p.h * p.kappa * carried(m, i, r) * abs(r * m.vm[i])


@tick
def behind(s, m, c):
    """Subtract the sliding distance from the reading `c` of the moved body; no reading where `c` is below 0."""
    if c >= 0:
        m.y[c] -= s.fallen


SLIP = Term(
    name="transmission.slip",
    remedies=("tension", "limits"),
    words="slip: pushed too hard, the contact slides and what was gained is lost for good",
    equation="|F| <= F_max; beyond it the contact slides, at (|F| - F_max) / eta",
    source="thesis 11.2 and 12.5",
    settings=SlipSettings,
    build=build_slip,
    act={
        "force": "contact.slip_joint({p}, {s}, {m}, {l})",
        "force:described": "contact.slip({p}, {s}, {m}, {i}, {r}, {l}, {k})",
        "reading:described": "contact.behind({s}, {m}, {c})",
        "force:ivu": "contact.slip_tape({p}, {s}, {m})",
        "force:ldu": "contact.slip_wheel({p}, {s}, {m}, {i}, {l})",
        "reading:ldu": "{m}.y[1] -= {s}.fallen",
    },
    moves=True,
    stands=(stand("joint", "contact"), stand("joint", "general spring", usual=False)),
    look_alikes={
        "transmission.creep": "one direction, softly and hard: creep loses travel in both, slip only in the hard one",
        "sensor.missed_counts": "hard acceleration at low top speed: counts are lost by speed, slip comes by force",
        "drive.saturation": "read both sides of the contact: a drive that clips moves both alike",
        "sensor.scale": "a long gentle move: the error of a wrong scale grows with distance, slip gives no error",
    },
    typical={"F_max": (0.5, 0.9)},
    scale={"F_max": "contact"},
    axis="tension",
    order=70,
    state=CONTACT_STATE,
    phrase=Phrase(
        noun="slip",
        head="the contact at {here} slips",
        detail="it carries no more than {F_max}",
        need="hard acceleration, with a sensor behind the contact",
    ),
    check=(
        "Mark both sides of the contact and see whether they move apart in hard acceleration; look at "
        "its pressure, oil and wear."
    ),
    units={"F_max": "force", "eta": "drag"},
    search=(Limit("F_max", "grip"),),
    richer=(Size("eta", "stiffness", 0.01),),
    contact=True,
    stiff=True,
    slips=True,
    draws={"F_max": Draw(1.05, 1.5, "contact")},
)
CREEP = Term(
    name="transmission.creep",
    remedies=("tension", "limits"),
    words="creep: under load the contact loses a little on every turn",
    equation="d' = kappa F |v|",
    source="Kalker 1990; thesis 11.2",
    settings=CreepSettings,
    build=build_creep,
    act={
        "force": "contact.creep_joint({p}, {s}, {m}, {l})",
        "force:described": "contact.creep({p}, {s}, {m}, {i}, {r}, {l}, {k})",
        "reading:described": "contact.behind({s}, {m}, {c})",
        "force:ivu": "contact.creep_tape({p}, {s}, {m}, {i})",
        "force:ldu": "contact.creep_wheel({p}, {s}, {m}, {i}, {l})",
        "reading:ldu": "{m}.y[1] -= {s}.fallen",
    },
    moves=True,
    stands=(
        stand("joint", "contact span"),
        stand("joint", "contact", usual=False),
        stand("joint", "general spring", usual=False, ways=(BY_WAY, (Size("rate", "yield", 0.001),))),
    ),
    look_alikes={
        "sensor.scale": "out with load and back without: a wrong scale gives equal errors, creep an error by load",
        "transmission.slip": "a gentle long move under load: creep grows with distance, slip needs a peak of force",
        "sensor.missed_counts": "hold the speed and raise the load: creep grows, lost counts do not",
        "geometry.radius_change": "turn back to the start: radii come back, creep does not",
    },
    typical={"kappa": (1e-3, 0.5)},
    axis="tension",
    shown="taut",
    order=70,
    state=CONTACT_STATE,
    phrase=Phrase(
        noun="creep",
        head="the contact at {here} creeps",
        detail="it loses {kappa} of the travel under load",
        need=BEHIND,
    ),
    check=(
        "Mark both sides of the contact and see whether they move apart in a long gentle move; look at its pressure."
    ),
    units={"kappa": "per_force", "rate": "yield"},
    search=BY_WAY,
    contact=True,
    stiff=True,
    draws={"kappa": Draw(0.001, 0.01, "per_contact")},
)
