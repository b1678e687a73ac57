"""Plan of a separating experiment: a motion, the separated rivals, and the form in diagnosis.json."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.diagnose.answer.motions import MENU, Limits, Motion
from rtctl.diagnose.answer.results import EXPERIMENT
from rtctl.diagnose.answer.si_format import nice

EASE = (1.0, 0.6, 0.35, 0.2)  # factors of speed and size, tried until the command stays within its limit
FULL = 0.95  # of the drive's limit: largest command of an experiment
OVER = 0.1  # share of the travel by which a simulated machine may overshoot the travel
SPEED_OVER = 0.02  # s, time over which a speed is taken
SMALLEST = 1e-5  # of the travel: resolution of a sensor of unknown resolution
NEARLY = 0.9  # of the largest distance: least distance of a motion that may be chosen for its short duration


class Tried(Protocol):
    """Outcome of a trial of a motion."""

    @property
    def trouble(self) -> str:
        """Reason why the motion cannot be run; "" where it can."""
        ...


Outcome = TypeVar("Outcome", bound=Tried)


class Experiment(NamedTuple):
    """Motion with the expected distances of the rivals."""

    motion: Motion
    limits: Limits
    rivals: tuple[str, ...]  # term:node, joined by " + "
    called: tuple[str, ...]  # the rivals in words
    distance: dict[str, float]  # by motion: distance of the least distinct rivals, over the noise
    pairs: dict[str, dict[str, float]]  # by motion: distance of each pair, over the noise
    refused: dict[str, str]  # motion -> reason of the refusal
    nats: dict[str, float] = {}  # noqa: RUF012  # by motion: expected gain in log probability of the right rival

    @property
    def name(self) -> str:
        """Name of the motion."""
        return self.motion.name

    @property
    def words(self) -> str:
        """Instruction in one or two sentences."""
        return self.motion.words

    @property
    def why(self) -> str:
        """Purpose in one sentence."""
        names = self.called
        told = " from ".join(names) if len(names) == 2 else f"{', '.join(names[:-1])} and {names[-1]} from each other"
        return f"It separates {told}: their predictions differ by {nice(self.distance[self.name])} times the noise."

    def as_dict(self) -> dict[str, Any]:
        """Experiment as in diagnosis.json."""
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


def limits_in(
    x: np.ndarray, dt: float, unit: str, command_unit: str, grain: float, command: float, over: float
) -> Limits:
    """Limits of a recorded motion x (n,) in `unit`; a speed is taken over `over` s."""
    x = x - x[0]
    step = min(max(1, round(over / dt)), len(x) // 8)
    v = (x[step:] - x[:-step]) / (step * dt)
    a = (v[step:] - v[:-step]) / (step * dt)
    low, high = float(x.min()), float(x.max())
    speed = float(np.quantile(np.abs(v), 0.99)) or float(np.abs(v).max())
    return Limits(
        unit=unit,
        command_unit=command_unit,
        dt=dt,
        low=low,
        high=high,
        speed=speed,
        acceleration=max(float(np.quantile(np.abs(a), 0.98)), 0.5 * speed),
        resolution=grain or SMALLEST * (high - low),
        command=command,
    )


def eased(limits: Limits, trial: Callable[[Motion], Outcome]) -> Iterator[tuple[Motion, Outcome]]:
    """Motions of the menu, each reduced until its trial succeeds, with the last trial."""
    for make in MENU:
        for ease in EASE:
            motion = make(limits._replace(acceleration=ease * limits.acceleration), ease)
            outcome = trial(motion)
            if not outcome.trouble:
                break
        yield motion, outcome


def chosen(
    motions: dict[str, Motion], pairs: dict[str, dict[str, float]], refused: dict[str, str], least: float
) -> tuple[str, dict[str, float]]:
    """Motion that separates the least distinct pair best, and the distance of this pair by motion.

    A pair that no motion separates by `least` does not count, unless there is no other pair. Raises NoAnswer where
    every motion was refused.
    """
    if not pairs:
        name, reason = next(iter(refused.items()))
        raise NoAnswer(f"no motion stays within the limits of this recording ({name}: {reason})")
    told = [p for p in next(iter(pairs.values())) if max(found[p] for found in pairs.values()) > least]
    counted = told or list(next(iter(pairs.values())))
    worst = {name: min(found[p] for p in counted) for name, found in pairs.items()}
    most = max(worst.values())
    return min((n for n in worst if worst[n] >= NEARLY * most), key=lambda n: motions[n].seconds), worst
