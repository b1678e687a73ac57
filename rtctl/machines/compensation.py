"""Compensation around the position law: settings, and their blocks and lines in a machine's tick.

    error     e = ref + shift - feedback                           shift: deflection of springs, delay of sensors
    law       u = law(e) + integral + feedforward + observer + learned + repeated
    limit     u -> inverse of the drive's curve -> limit

An absent setting adds no line, so the tick of a config without compensation is unchanged.
"""

from typing import Any, NamedTuple

from pydantic import Field, create_model, model_validator

from rtctl.config.unit_change import with_units
from rtctl.idiom import Settings, quantity
from rtctl.laws import (
    disturbance_observer,
    error_table,
    integral,
    inverse_curve,
    iterative_learning,
    map_feedforward,
    model_feedforward,
    predictor,
    repetitive,
    sections,
)
from rtctl.laws.disturbance_observer import DisturbanceObserverSettings
from rtctl.laws.error_table import ErrorTableSettings
from rtctl.laws.integral import IntegralSettings
from rtctl.laws.inverse_curve import InverseCurveSettings
from rtctl.laws.iterative_learning import IterativeLearningSettings
from rtctl.laws.map_feedforward import MapFeedforwardSettings
from rtctl.laws.predictor import PredictorSettings
from rtctl.laws.repetitive import RepetitiveSettings
from rtctl.laws.sections import SectionsSettings
from rtctl.machines.base import Block, physics_lines
from rtctl.machines.physics import PhysicsTerm
from rtctl.machines.reference_motion import Mechanics, params
from rtctl.plants.physics import TERMS

ACTS = ("command", "force", "last")  # sites of effects that a feedforward can compensate


class EffectSettings(Settings):
    """Effect that the feedforward compensates."""

    effect: PhysicsTerm = Field(description="the effect as in plant.physics; `rtctl physics` lists them")
    share: float = quantity(1.0, unit="", ge=0, le=1.5, help="part of it that is compensated; 0 switches it off")


class ModelFeedforwardSettings(Settings):
    """The command that the model needs to move along the reference."""

    inertia: float = quantity(1.0, unit="", ge=0, le=1.5, help="share of the inertia; the shaper has to be on")
    friction: float = quantity(
        0.9, unit="", ge=0, le=1, help="share of the description's dry friction, below breakaway"
    )
    viscous: float = quantity(1.0, unit="", ge=0, le=1.5, help="share of the viscous friction and of the springs")
    velocity: float = quantity(
        1.0, unit="", ge=0, le=1, help="share of the velocity feedback that the reference's speed cancels"
    )
    lead: float = quantity(
        0.0, unit="s", ge=0, le=0.1, help="time until a command acts; the reference is read ahead by it"
    )
    behind: float = quantity(0.0, unit="s", ge=0, le=0.1, help="delay of the sensor")
    through: str | None = Field(
        default=None, description="body behind springs that must follow the reference, in place of the feedback"
    )
    effects: list[EffectSettings] = Field(default=[], max_length=12, description="effects that are compensated")

    @model_validator(mode="after")
    def _acts(self) -> "ModelFeedforwardSettings":
        for i, entry in enumerate(self.effects):
            if not any(site.partition(":")[0] in ACTS for site in TERMS[entry.effect.term].act):
                raise ValueError(
                    f"effects.{i}.effect: {entry.effect.term} neither adds a force nor changes a command; no "
                    "feedforward can compensate it"
                )
        return self


class CompensationSettings(Settings):
    """Compensation of the machine's known and unknown errors; `rtctl improve` proposes it from a diagnosis."""

    feedforward: ModelFeedforwardSettings | None = Field(
        default=None, description="feedforward by the model; none if absent"
    )
    integral: IntegralSettings | None = Field(default=None, description="integral with dead zone; none if absent")
    observer: DisturbanceObserverSettings | None = Field(
        default=None, description="disturbance observer; none if absent"
    )
    filter: SectionsSettings | None = Field(
        default=None, description="notches and filters behind the position law; none if absent"
    )
    map: MapFeedforwardSettings | None = Field(
        default=None, description="command over angle or place, from a table; none if absent"
    )
    learning: IterativeLearningSettings | None = Field(
        default=None, description="command over the time of the move, learned run by run; none if absent"
    )
    repetitive: RepetitiveSettings | None = Field(
        default=None, description="learns during motion the error that repeats with every turn; none if absent"
    )
    predictor: PredictorSettings | None = Field(
        default=None, description="predicts the position after the delay, as the law's feedback; none if absent"
    )
    correction: ErrorTableSettings | None = Field(
        default=None, description="table over the feedback that is added to the feedback; none if absent"
    )
    inverse: InverseCurveSettings | None = Field(
        default=None, description="inverse of the drive's curve; none if absent"
    )


def in_units(symbols: dict[str, str]) -> Any:
    """Settings class with other units; effects keep those of `plant.physics`."""
    own = CompensationSettings.model_fields["feedforward"]
    base = with_units(CompensationSettings, symbols)
    return create_model(
        "CompensationSettings", __base__=base, __module__=__name__, __doc__=base.__doc__,
        feedforward=(ModelFeedforwardSettings | None, own),
    )  # fmt: skip


class Lines(NamedTuple):
    """Modules, blocks and lines of compensation in a tick."""

    uses: tuple[str, ...] = ()
    blocks: tuple[Block, ...] = ()
    read: tuple[str, ...] = ()  # once the feedback is read
    reset: tuple[str, ...] = ()  # where outputs come on
    reference: tuple[str, ...] = ()  # once the shaped reference is known
    filter: tuple[str, ...] = ()  # of the position law's output
    shift: str = ""  # added to the reference where the error is made
    closed: str = ""  # position that the law closes on, where it is not the feedback
    law: tuple[str, ...] = ()  # into `extra`, V to add to the command
    extra: str = ""  # added to the command
    inverse: tuple[str, ...] = ()  # after the limit's input is known
    track: tuple[str, ...] = ()  # after the limit


NONE = Lines()


class Signals(NamedTuple):
    """Names of the signals in a machine's tick."""

    law: str  # output of the position law
    error: str
    feedback: str
    speed: str  # measured; of the tick before where the machine computes it later
    wanted: str  # command before the limit, and before the inverse of the drive's curve
    asked: str  # input of the limit
    written: str  # output of the limit
    known: str  # V, friction compensation by the machine's own feedforward
    channel: dict[int, float]  # drive -> share of the command; empty where an allocation distributes the command
    beside: str = "0.0"  # V, positive command that accelerates as the voltages outside the command do


def lines(settings: CompensationSettings, names: Signals, kind: str, mechanics: Any, dt: float) -> Lines:
    """Blocks and lines for a tick of `dt` s; `mechanics()` gives the machine's, for those that need them.

    Raises ValueError with the key at fault in the sentence.
    """
    uses: list[str] = []
    blocks: list[Block] = []
    reset: list[str] = []
    reference: list[str] = []
    law: list[str] = []
    track: list[str] = []
    inverse: list[str] = []
    extra: list[str] = []
    filtered: list[str] = []
    read: list[str] = []
    shift = ""
    if settings.feedforward is not None:
        found = _feedforward(settings.feedforward, names, kind, mechanics(), dt)
        uses += found.uses
        blocks += found.blocks
        reset += found.reset
        reference += found.reference
        shift = found.shift
        extra.append("u_model")
    if settings.filter is not None:
        uses.append("rtctl.laws.sections")
        blocks.append(Block("filter", sections.build(settings.filter, dt), sections.SECTIONS_STATE))
        reset.append("sections.reset(p.filter, s.filter, 0.0)")
        filtered.append(f"{names.law} = sections.step(p.filter, s.filter, {names.law})")
    if settings.integral is not None:
        uses.append("rtctl.laws.integral")
        blocks.append(Block("integral", integral.build(settings.integral, dt), integral.INTEGRAL_STATE))
        reset.append("integral.reset(p.integral, s.integral)")
        law.append(f"u_integral = integral.step(p.integral, s.integral, {names.error})")
        track.append(f"integral.track(p.integral, s.integral, {names.asked}, {names.written})")
        extra.append("u_integral")
    if settings.observer is not None:
        known = names.known
        if settings.feedforward is not None:
            known = f"{known} + s.model_feedforward.known"
        made = disturbance_observer.build(settings.observer, dt)
        uses.append("rtctl.laws.disturbance_observer")
        blocks.append(Block("observer", made, disturbance_observer.DISTURBANCE_OBSERVER_STATE))
        reset.append("disturbance_observer.reset(p.observer, s.observer)")
        law.append(f"u_observer = disturbance_observer.step(p.observer, s.observer, {names.feedback})")
        acting = names.written if settings.inverse is None else f"{names.wanted} + ({names.written} - {names.asked})"
        track.append(f"disturbance_observer.track(p.observer, s.observer, {acting}, {known}, {names.beside})")
        extra.append("u_observer")
    if settings.map is not None:
        uses.append("rtctl.laws.map_feedforward")
        blocks.append(Block("map", map_feedforward.build(settings.map, dt), None))
        law.append("u_map = map_feedforward.step(p.map, y.ref, s.shaper.speed)")
        extra.append("u_map")
    if settings.learning is not None:
        uses.append("rtctl.laws.iterative_learning")
        blocks.append(Block("learning", iterative_learning.build(settings.learning, dt), None))
        now = "s.reference.mode, k - s.reference.k0, t.reference.period"
        law.append(f"u_learned = iterative_learning.step(p.learning, {now})")
        extra.append("u_learned")
    if settings.repetitive is not None:
        if settings.repetitive.gain > 0.0 and not mechanics().shaped:  # else it would learn nothing, silently
            raise ValueError(
                "law.compensation.repetitive learns while the shaped reference moves; law.shaper.bandwidth is missing"
            )
        uses.append("rtctl.laws.repetitive")
        blocks.append(Block("repetitive", repetitive.build(settings.repetitive, dt), repetitive.REPETITIVE_STATE))
        reset.append("repetitive.reset(p.repetitive, s.repetitive)")
        now = f"{names.feedback}, s.shaper.speed, {names.error}"
        law.append(f"u_repeated = repetitive.step(p.repetitive, s.repetitive, {now})")
        extra.append("u_repeated")
    closed = names.feedback
    if settings.predictor is not None:
        uses.append("rtctl.laws.predictor")
        blocks.append(Block("predictor", predictor.build(settings.predictor, dt), predictor.PREDICTOR_STATE))
        reset.append("predictor.reset(p.predictor, s.predictor)")
        track.append(f"predictor.track(p.predictor, s.predictor, {names.written})")
        closed = f"predictor.step(p.predictor, s.predictor, {names.feedback}, {names.speed})"
    if settings.correction is not None:
        uses.append("rtctl.laws.error_table")
        blocks.append(Block("correction", error_table.build(settings.correction, dt), None))
        read.append(f"{names.feedback} = error_table.step(p.correction, {names.feedback})")
    if settings.inverse is not None:
        uses.append("rtctl.laws.inverse_curve")
        blocks.append(Block("inverse", inverse_curve.build(settings.inverse, dt), None))
        inverse.append(f"{names.asked} = inverse_curve.step(p.inverse, {names.wanted})")
    return Lines(
        uses=tuple(uses),
        blocks=tuple(blocks),
        read=tuple(read),
        reset=tuple(reset),
        reference=tuple(reference),
        filter=tuple(filtered),
        shift=shift,
        closed=closed,
        law=tuple(law),
        extra="".join(f" + {name}" for name in extra),
        inverse=tuple(inverse),
        track=tuple(track),
    )


def _feedforward(
    settings: ModelFeedforwardSettings, names: Signals, kind: str, mechanics: Mechanics, dt: float
) -> Lines:
    """Feedforward lines: the model's record is moved along the reference, and the effects' lines act on the record."""
    made = params(mechanics, settings, dt)
    uses = ["rtctl.laws.model_feedforward"]
    blocks = [Block("model_feedforward", made, model_feedforward.MODEL_FEEDFORWARD_STATE)]
    state, record = "s.model_feedforward", "s.model_feedforward.m"
    head = f"p.model_feedforward, {state}"
    out = [f"a_model = model_feedforward.begin({head}, y.ref, s.shaper.speed, s.shaper.acceleration)"]
    drives: list[str] = []
    order = sorted(enumerate(settings.effects), key=lambda item: TERMS[item[1].effect.term].order)
    for number, entry in order:
        prefix = f"effect{number}_"
        found = physics_lines([entry.effect], kind, dt, mechanics.place_of, record, prefix)
        uses += found.uses
        blocks += [*found.blocks, Block(f"{prefix}share", ShareParams(entry.share), None)]
        if found.force:
            share = f"p.{prefix}share.share"
            out += [f"model_feedforward.keep({state})", *found.force, f"model_feedforward.blend({state}, {share})"]
        if found.command and names.channel:
            drives.append(number)  # type: ignore[arg-type]
            at, factor = next(iter(names.channel.items()))
            asked = f"{factor!r} * u_model"
            out_of = [f"{record}.volts[{at}] = {asked}", *found.command]
            drives[-1] = "\n".join(
                [*out_of, f"u_model += p.{prefix}share.share * ({asked} - {record}.volts[{at}]) / {factor!r}"]
            )
    out.append(f"u_model = model_feedforward.finish({head}, a_model)")
    for text in drives:
        out += text.split("\n")
    return Lines(
        uses=tuple(dict.fromkeys(uses)),
        blocks=tuple(blocks),
        reset=(f"model_feedforward.reset({head})",),
        reference=tuple(out),
        shift=f" + {state}.shift",
    )


class ShareParams(NamedTuple):
    share: float
