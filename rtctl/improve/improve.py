"""Improvement: every remedy is tried alone on the emulated fitted model, and kept where it reduces the error.

A remedy is kept where the rms of the tracking error falls, where this error does not rise at either end of the interval
of the effect's size, and where the loop keeps its margins: 6 dB and 45 degrees, or the former margins. All kept
remedies are checked together at the end. A remedy against a misnamed effect is therefore harmless or left out.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from rtctl import machines
from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import set_paths
from rtctl.design.margins import Margins
from rtctl.improve import margins, played
from rtctl.improve.found import Found, with_size
from rtctl.improve.ground import Ground
from rtctl.improve.played import Figures, Judge, Played
from rtctl.improve.proposals import LEAST, data_of, proposals
from rtctl.improve.remedy import BASE, Remedy, Tried, neutral, written
from rtctl.machines.reference_motion import motion

GIVEN = 0.25  # share by which the error may rise for margins that were missing
GAIN = 0.005  # share by which the error must fall
WORSE = 0.01  # share by which it may rise at an end of an interval
Progress = Callable[[str], None]


class Improved(NamedTuple):
    """An improved config, and the proof on the emulated fitted model."""

    found: Found
    config: Any  # fused, with the reference that was played
    trial: Any  # the improved law with every tried block; blocks that were left out do nothing
    without: Any  # the former law with every tried block; all blocks do nothing
    mode: str  # loop.mode that the config had
    judge: Judge
    tried: tuple[Tried, ...]
    before: Played
    after: Played
    margins_before: Margins | None
    margins_after: Margins | None

    @property
    def reduction(self) -> float:
        """Share by which the rms of the tracking error falls."""
        return 1.0 - self.after.figures.rms / self.before.figures.rms


def improve(
    found: Found, body: str | None = None, progress: Progress = lambda _: None, written_too: bool = True
) -> Improved:
    """Propose, try and keep remedies; with `written_too` the config as it is written is played as well.

    Raises NoAnswer where the machine does not run with its present law.
    """
    mode = found.config.loop.mode
    found = found._replace(config=played.with_reference(found.config))
    config = found.config
    judge = played.judge_of(config, body)
    at_first = margins.of_config(config)
    ground = Ground(found, judge, at_first, acceleration(config), travel(config))
    trial = Trial(ground, proposals(ground))
    tried = []
    for remedy in trial.plan:
        progress(f"trying {remedy.title} against {remedy.against}")
        tried.append(trial.of(remedy))
    progress("checking all kept remedies together")
    made = set_paths(config, written(trial.values, data_of(config)))
    after = played.play(made if written_too else trial.config({}), config, trial.seconds, judge, trial.asked)
    if after.figures.tripped or after.figures.rms > trial.before.figures.rms:
        raise NoAnswer("all remedies together are worse than none; the config stays as it is")
    laws = made, trial.config({}), trial.base
    return Improved(found, *laws, mode, judge, tuple(tried), trial.before, after, at_first, margins.of_config(made))


def travel(config: Any) -> tuple[float, float]:
    """Lowest and highest value of the reference."""
    table = machines.build(config).reference
    values = table.r[: table.n]
    return float(values.min()), float(values.max())


def acceleration(config: Any) -> tuple[float, float] | None:
    """Acceleration of the feedback for one unit of positive and of negative command, in its unit; None where no
    feedforward can be made."""
    try:
        made = motion(mechanics_of(config))
    except (ValueError, UserError):
        return None
    inertia = made.phi @ (made.M * made.phi)
    return float(made.phi @ made.plus / inertia), float(made.phi @ made.minus / inertia)


def mechanics_of(config: Any) -> Any:
    """Mechanics of a config's machine. Raises ValueError where no feedforward can be made for it."""
    machine = machines.build(config)
    module = machines.module_of(config.kind)
    if not hasattr(module, "mechanics"):
        raise ValueError(f"{config.kind} has no feedforward by its model")
    return module.mechanics(config, machine.dt)


class Trial:
    """Trials of remedies, one after the other, in addition to the kept remedies."""

    def __init__(self, ground: Ground, plan: list[Remedy]):
        found, self.judge, self.plan = ground.found, ground.judge, plan
        config = self.plant = found.config
        kinds = {remedy.kind for remedy in plan}
        shares = sorted(
            {int(path.split(".")[4]) for r in plan for way in r.ways for path in way if ".effects." in path}
        )
        self.order = {str(number): n for n, number in enumerate(shares)}
        entries = data_of(config)
        base = neutral(tuple(entries[i] for i in shares), ground.gain is not None, "curve" in kinds, "table" in kinds)
        self.base = set_paths(config, {BASE: base})
        self.effects = {effect.words: effect for effect in found.effects}
        self.values: dict[str, Any] = {}
        self.seconds, self.at_first = played.seconds_of(config), ground.margins
        self.before = played.play(self.base, config, self.seconds, self.judge)
        if self.before.figures.tripped:
            raise NoAnswer(
                f"the emulated machine trips with the law that it has ({self.before.figures.tripped}): there is "
                "nothing to compare with; let `rtctl tune` find a law that holds it"
            )
        self.asked = self.before.ref
        self.rms, self.figures = self.before.figures.rms, self.before.figures

    def of(self, remedy: Remedy) -> Tried:
        """Try every way of a remedy, and keep the best where it passes."""
        if remedy.kind == "margins":
            return self.of_margins(remedy)
        best: tuple[float, Mapping[str, Any], Figures] | None = None
        reason = ""
        for way in remedy.ways:
            try:
                config = self.config(way)
                if not self.holds(config):
                    reason = reason or self.margins_words(config)
                    continue
                run = played.play(config, self.plant, self.seconds, self.judge, self.asked)
            except (UserError, ValueError, NoAnswer) as error:
                reason = str(error)
                continue
            if run.figures.tripped:
                reason = f"the emulated machine trips: {run.figures.tripped}"
                continue
            if best is None or run.figures.rms < best[0]:
                best = run.figures.rms, way, run.figures
        before = self.rms
        if best is None:
            return Tried(remedy, {}, before, np.inf, reason or "no setting of it passes", None, None)
        after, way, figures = best
        if after > (1.0 - GAIN) * before:
            change = 100 * (after / before - 1)
            return Tried(remedy, {}, before, after, f"the error does not fall by it ({change:+.1f} %)", figures, None)
        worse = self.worse_at_ends(remedy, way)
        if worse:
            return Tried(remedy, {}, before, after, worse, figures, None)
        self.values |= way
        self.rms, self.figures = after, figures
        return Tried(remedy, way, before, after, "", figures, margins.of_config(self.config({})))

    def of_margins(self, remedy: Remedy) -> Tried:
        """Keep the first way, by falling gain, that gives the margins and raises the error by GIVEN at most."""
        before = self.rms
        reason = (
            f"no notch and no lower gain gives {LEAST[0]:g} dB and {LEAST[1]:g} degrees for {GIVEN:.0%} of the error"
        )
        for way in remedy.ways:
            config = self.config(way)
            now = margins.of_config(config)
            if now is None or not (now.stable and now.GM >= LEAST[0] and now.PM >= LEAST[1]):
                continue
            run = played.play(config, self.plant, self.seconds, self.judge, self.asked)
            if run.figures.tripped or run.figures.rms > (1.0 + GIVEN) * before:
                continue
            self.values |= way
            self.rms, self.figures, self.at_first = run.figures.rms, run.figures, now
            return Tried(remedy, way, before, self.rms, "", run.figures, now)
        return Tried(remedy, {}, before, np.inf, reason, None, None)

    def config(self, way: Mapping[str, Any]) -> Any:
        """Trial config with the kept remedies and this way. Raises UserError where it is inconsistent."""
        return set_paths(self.base, {self._path(path): value for path, value in {**self.values, **way}.items()})

    def _path(self, path: str) -> str:
        """Path in the trial config, where effects are numbered among the effects that are fed forward."""
        parts = path.split(".")
        if "effects" in parts:
            parts[4] = str(self.order[parts[4]])
        return ".".join(parts)

    def holds(self, config: Any) -> bool:
        """Whether the loop is stable with the least margins."""
        now, least = margins.of_config(config), self.least
        return now is None or bool(now.stable and now.GM >= least[0] and now.PM >= least[1])

    @property
    def least(self) -> tuple[float, float]:
        """Least margins, dB and degrees: LEAST, or the former margins where these are smaller."""
        if self.at_first is None:
            return LEAST
        return min(LEAST[0], self.at_first.GM - 1e-6), min(LEAST[1], self.at_first.PM - 1e-6)

    def margins_words(self, config: Any) -> str:
        """Sentence on margins that are too small."""
        now, least = margins.of_config(config), self.least
        if now is None or not now.stable:
            return "the loop would be unstable"
        return (
            f"{now.GM:.1f} dB and {now.PM:.0f} degrees would be left, {least[0]:.1f} and {least[1]:.0f} are asked for"
        )

    def worse_at_ends(self, remedy: Remedy, way: Mapping[str, Any]) -> str:
        """Reason to leave out a remedy by the error at the ends of its effect's interval; "" where there is none."""
        effect = self.effects.get(remedy.against)
        if effect is None:
            return ""
        for end in effect.ends:
            plant = with_size(self.plant, effect, end)
            try:
                without, with_it = (
                    played.play(self.config(values), plant, self.seconds, self.judge, self.asked).figures
                    for values in ({}, way)
                )
            except (UserError, ValueError):
                continue  # no machine can be built with this size
            if with_it.rms > (1.0 + WORSE) * without.rms:
                name, value = next(iter(end.items()))
                return f"at {name} = {value:.4g}, an end of its interval, the error would rise"
        return ""
