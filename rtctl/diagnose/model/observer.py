"""Tracking observer: its followed sensors, bandwidths and equivalent forces."""

from typing import NamedTuple

from rtctl.diagnose.model.model import rigid
from rtctl.diagnose.model.recording import GraphRecord

FOLLOW = 30.0  # rad/s, bandwidth of the observer of a position sensor
DAMPED = 1.4  # twice its damping ratio
SMOOTHED = 10.0  # bandwidth of the filtered rate of the error over that of the observer
FOLLOW_SPEED = 5.0  # rad/s, bandwidth of the observer of a speed sensor, which has more noise and no drift


class Followed(NamedTuple):
    """Sensor that the observer follows."""

    sensor: str
    body: str
    shows_speed: bool

    @property
    def bandwidth(self) -> float:
        """Usual bandwidth of its observer, rad/s."""
        return FOLLOW_SPEED if self.shows_speed else FOLLOW


def stiffness(follow: float, inertia: float) -> tuple[float, float]:
    """Equivalent stiffness and damping of an observer: force, N or Nm, for a unit of its error and of the error rate.

    `follow` is the bandwidth, rad/s, `inertia` the reflected inertia at the followed body, kg or kg m^2.
    """
    return follow**2 * inertia, DAMPED * follow * inertia


def followed(record: GraphRecord) -> tuple[Followed, ...]:
    """Followed sensors: the main one, and one for each group of bodies that no joint connects with a followed body."""
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
