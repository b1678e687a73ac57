"""From a running machine to a better model of it: record, diagnose, where two answers are left run the experiment that
separates them and diagnose again, write the model.

What is recorded is an ordinary run (`rtctl run`), so the bundles are there to be looked at and diagnosed again.
"""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import set_path
from rtctl.diagnose.answer import played
from rtctl.diagnose.answer.answer import GraphDiagnosis, diagnose
from rtctl.diagnose.answer.nominal_duty import duty_of
from rtctl.diagnose.model.by_symbol import Model
from rtctl.machines.duty import Duty
from rtctl.machines.profiles import profile_of

LENGTH = 25.0  # s, of a recording of a machine that declares none
RECORDING, SECOND = "recording", "experiment"  # bundles in the folder of a repair
NEGLIGIBLE = 1e-4  # share of a value below which it has not changed
LEGS = (  # (share of the travel, share of the speed): far and fast, and at a crawl where friction shows itself
    (0.5, 1.0), (0.45, 0.05), (-0.3, 1.0), (-0.27, 0.1), (0.2, 0.5), (0.17, 0.05), (0.0, 0.7),
)  # fmt: skip
DWELL = 0.5  # s

Say = Callable[[str], None]


class Repair(NamedTuple):
    """What a machine taught: recordings and diagnoses in order; the last one counts."""

    bundles: tuple[Path, ...]
    diagnoses: tuple[GraphDiagnosis, ...]
    trips: tuple[str, ...]  # of the recordings: "" for none

    @property
    def last(self) -> GraphDiagnosis:
        """The diagnosis whose model is written."""
        return self.diagnoses[-1]

    @property
    def bundle(self) -> Path:
        """The recording that it is of."""
        return self.bundles[len(self.diagnoses) - 1]


def ready(config: Any, mode: str | None = None) -> Any:
    """The config as it is recorded: on virtual time where the machine is emulated here, with something to play.

    Raises UserError where a machine that is not ours has no reference: nobody knows how far it may go.
    """
    if mode is None and config.link.spawns:
        config = set_path(config, "loop.mode", "fused")
    if config.reference.steps or config.reference.knots or config.excitation.kind != "none":
        return config
    if not config.link.spawns:
        raise UserError(
            f"{config.name}: it has no reference, and how far a machine may be moved is its owner's to say; "
            "name one with --reference FILE"
        )
    if profile_of(config.kind).duty is None:
        raise UserError(
            f"{config.name}: it has no reference, and a description does not say how far its machine moves; name one "
            "with --reference FILE, or write `reference:` into the config"
        )
    return set_path(config, "reference", ordinary_reference(duty_of(config)))


def ordinary_reference(duty: Duty) -> dict[str, Any]:
    """To and fro at several speeds with rests in between, within what the machine is used to and the usual recording;
    rad or m, and s."""
    speed, travel = duty.speed, duty.travel
    shares = [0.0, *(share for share, _ in LEGS)]
    moving = sum(abs(b - a) / pace for (a, b), (_, pace) in zip(pairwise(shares), LEGS, strict=True)) * travel / speed
    travel *= min(1.0, (duty.recording - DWELL * (len(LEGS) + 1)) / moving)
    steps, t, at = [], DWELL, 0.0
    for share, pace in LEGS:
        to, rate = share * travel, pace * speed
        steps.append({"at": round(t, 3), "to": round(to, 9), "ramp": round(rate, 9)})
        t += abs(to - at) / rate + DWELL
        at = to
    return {"steps": steps, "repeat": round(t, 3)}


def length_of(config: Any) -> float:
    """Usual length of a recording, s."""
    duty = profile_of(config.kind).duty
    return LENGTH if duty is None else duty.recording


def repair(
    config: Any,
    out: Path,
    length: float | None = None,
    progress: Say = lambda text: None,
    record: Callable[[Any, Path, float], dict[str, Any]] | None = None,
    diagnose: Callable[..., Any] = diagnose,
) -> Repair:
    """Record the machine of a config that is `ready` into bundles in `out`, and diagnose it.

    `record` runs the machine (see `run`), `diagnose` is the judge; the recording of an experiment is diagnosed together
    with the first. Raises UserError and NoAnswer as these do; what becomes of the experiment cannot undo the first
    diagnosis.
    """
    run_ = record or run
    seconds = length_of(config) if length is None else length
    bundle = out / RECORDING
    progress(f"recording {seconds:g} s")
    trips = [run_(config, bundle, seconds)["tripped"] or ""]
    if trips[0]:
        progress(f"the run ended early, with a trip: {trips[0]}")
    first = diagnose(bundle, progress=progress)
    if first.experiment is None:
        return Repair((bundle,), (first,), tuple(trips))
    names = " or ".join(dict.fromkeys(e.name for e in first.effects)) or first.verdict
    second = out / SECOND
    config, seconds = played.playing(config, first.experiment, seconds)
    progress(f"{names}: recording the experiment that separates them, {seconds:g} s")
    trips.append(run_(config, second, seconds)["tripped"] or "")
    try:
        again = diagnose(bundle, second, progress=progress)
    except (NoAnswer, UserError) as error:
        progress(f"the experiment says nothing: {error}")
        return Repair((bundle, second), (first,), tuple(trips))
    if trips[-1] and again.verdict != "named":
        progress(f"the experiment ended with a trip ({trips[-1]}) and names nothing; the first diagnosis stands")
        return Repair((bundle, second), (first,), tuple(trips))
    return Repair((bundle, second), (first, again), tuple(trips))


def run(config: Any, bundle: Path, seconds: float, say: Say = lambda text: None) -> dict[str, Any]:
    """One recording as `rtctl run` makes it. Raises UserError where it cannot be run, RunFailed where it went wrong."""
    from rtctl.daemon.session import Session, whole

    return whole(Session(config, bundle, seconds, arm=True, say=say).run())


def between(owner: Model, after: Model) -> list[tuple[str, str, str]]:
    """(key, owner's value, new value) of each key of the config that a model changes, the terms last."""
    rows = []
    for name, value in after.base.items():
        was = owner.base.get(name)
        if was is None or abs(value - was) > NEGLIGIBLE * max(abs(was), abs(value)):
            rows.append((f"plant.parameters.{name}", "-" if was is None else f"{was:.4g}", f"{value:.4g}"))
    return rows + played.terms(after.terms, len(owner.terms))
