"""Sensors that a tracking observer follows."""

from typing import NamedTuple

from rtctl.diagnose.model.model import rigid
from rtctl.diagnose.model.recording import GraphRecord

FOLLOW = 30.0  # rad/s, bandwidth of the observer of a position
DAMPED = 1.4  # twice its damping ratio
SMOOTHED = 10.0  # bandwidths of the observer: that of the rate of its error
FOLLOW_SPEED = 5.0  # rad/s, of a speed: it does not drift, and has more noise to average


class Followed(NamedTuple):
    """A sensor that the model is made to follow."""

    sensor: str
    body: str
    shows_speed: bool

    @property
    def bandwidth(self) -> float:
        """Usual bandwidth of its observer, rad/s."""
        return FOLLOW_SPEED if self.shows_speed else FOLLOW


def stiffness(follow: float, inertia: float) -> tuple[float, float]:
    """Force of an observer for a unit of its error in position, and for a unit in speed, N or Nm each.

    `follow` is the bandwidth, rad/s, `inertia` that of the followed body with all that moves with it.
    """
    return follow**2 * inertia, DAMPED * follow * inertia


def followed(record: GraphRecord) -> tuple[Followed, ...]:
    """Sensors that the observer follows: the main one, and of each body that joints do not connect with one of them."""
    case = record.case
    sensors = case.machine.sensors
    order = [record.main, *(n for wanted in ("position", "speed") for n, s in sensors.items() if s.measures == wanted)]
    out: list[Followed] = []
    reached: set[str] = set()
    for name in order:
        body = str(sensors[name].body)
        if name not in record.y or body in reached or (out and sensors[name].body is None):
            continue
        out.append(Followed(name, body, sensors[name].measures == "speed"))
        reached |= {other for other, ratio in rigid(case.layout, case.values, body).items() if ratio != 0.0}
    return tuple(out)
