"""Plan of a separating experiment: a motion, the rivals that it tells apart, and its form in diagnosis.json."""

from typing import Any, NamedTuple

from rtctl.diagnose.motions import Limits, Motion
from rtctl.diagnose.numbers import nice
from rtctl.diagnose.results import EXPERIMENT

EASE = (1.0, 0.6, 0.35, 0.2)  # of speed and size, until the command stays within its limit
FULL = 0.95  # of the drive's limit
OVER = 0.1  # share of the travel by which a simulated machine may overshoot it
SPEED_OVER = 0.02  # s, a speed is taken over this
NEARLY = 0.9  # of the largest distance: of all that come this near, the shortest motion is taken


class Experiment(NamedTuple):
    """A motion, and what it is expected to show."""

    motion: Motion
    limits: Limits
    rivals: tuple[str, ...]  # term:node, joined by " + "
    called: tuple[str, ...]  # the rivals in words
    distance: dict[str, float]  # of each motion: how far the least distinct rivals are apart, over the noise
    pairs: dict[str, dict[str, float]]  # of each motion: of each pair
    refused: dict[str, str]  # motion -> why not
    nats: dict[str, float] = {}  # noqa: RUF012  # of each motion: expected gain in log probability of the right rival

    @property
    def name(self) -> str:
        """Name of the motion."""
        return self.motion.name

    @property
    def words(self) -> str:
        """What to do, in a sentence or two."""
        return self.motion.words

    @property
    def why(self) -> str:
        """What it is for, in a sentence."""
        names = self.called
        told = " from ".join(names) if len(names) == 2 else f"{', '.join(names[:-1])} and {names[-1]} from each other"
        return f"It tells {told}: what they predict is {nice(self.distance[self.name])} times the noise apart."

    def as_dict(self) -> dict[str, Any]:
        """As in diagnosis.json."""
        limits = self.limits
        return {
            "name": self.name,
            "words": self.words,
            "why": {
                "words": self.why,
                "rivals": list(self.rivals),
                "distance": {k: round(v, 4) for k, v in self.distance.items()},
                "pairs": {k: round(v, 4) for k, v in self.pairs[self.name].items()},
                "refused": dict(self.refused),
                **({"nats": {k: round(v, 2) for k, v in self.nats.items()}} if self.nats else {}),
            },
            "reference": {
                "unit": limits.unit,
                "knots": [[round(float(t), 6), float(f"{r:.7g}")] for t, r in self.motion.knots],
                "repeat": self.motion.repeat,
                "relative": True,
            },
            "excitation": None,  # every motion of the menu is a reference
            "seconds": round(self.motion.seconds, 3),
            "limits": {"travel": [limits.low, limits.high], "speed": limits.speed, "command": limits.command},
            "file": EXPERIMENT,
        }
