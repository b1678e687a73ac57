"""Repair of a model: record the machine, diagnose, run a separating experiment where two answers are probable, diagnose
again, write the model.

A recording is an ordinary run (`rtctl run`): its bundle can be viewed and diagnosed again.
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

LENGTH = 25.0  # s, recording of a machine without a declared duty
RECORDING, SECOND = "recording", "experiment"  # bundles in the folder of a repair
NEGLIGIBLE = 1e-4  # share of a value: least change that is reported
LEGS = (  # (share of the travel, share of the speed): far and fast, and slow for friction
    (0.5, 1.0), (0.45, 0.05), (-0.3, 1.0), (-0.27, 0.1), (0.2, 0.5), (0.17, 0.05), (0.0, 0.7),
)  # fmt: skip
DWELL = 0.5  # s, rest after each leg

Say = Callable[[str], None]


class Repair(NamedTuple):
    """Recordings and diagnoses of a repair in order; the last diagnosis counts."""

    bundles: tuple[Path, ...]
    diagnoses: tuple[GraphDiagnosis, ...]
    trips: tuple[str, ...]  # trip of each recording; "" for none

    @property
    def last(self) -> GraphDiagnosis:
        """Diagnosis whose model is written."""
        return self.diagnoses[-1]

    @property
    def bundle(self) -> Path:
        """Bundle of the last diagnosis."""
        return self.bundles[len(self.diagnoses) - 1]


def ready(config: Any, mode: str | None = None) -> Any:
    """Config for a recording: on virtual time where the machine is emulated, and with a reference.

    Raises UserError where a real machine has no reference: its safe travel is unknown.
    """
    if mode is None and config.link.spawns:
        config = set_path(config, "loop.mode", "fused")
    if config.reference.steps or config.reference.knots or config.excitation.kind != "none":
        return config
    if not config.link.spawns:
        raise UserError(
            f"{config.name}: it has no reference, and rtctl chooses no motion for a machine that it does not emulate; "
            "give one with --reference FILE"
        )
    if profile_of(config.kind).duty is None:
        raise UserError(
            f"{config.name}: it has no reference, and the description does not say how far the machine moves; give one "
            "with --reference FILE, or write `reference:` into the config"
        )
    return set_path(config, "reference", ordinary_reference(duty_of(config)))


def ordinary_reference(duty: Duty) -> dict[str, Any]:
    """Reference of moves at several speeds with rests in between, within nominal travel and the usual recording time;
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
    """Usual duration of a recording, s."""
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
    """Repair of the machine of a config that is `ready`: bundles recorded in `out`, and their diagnoses.

    `record` runs the machine (see `run`), `diagnose` diagnoses bundles; the recording of an experiment is diagnosed
    together with the first. Raises UserError and NoAnswer of `record` and the first `diagnose`; a failed experiment
    keeps the first diagnosis.
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
        progress(f"the experiment supports no verdict: {error}")
        return Repair((bundle, second), (first,), tuple(trips))
    if trips[-1] and again.verdict != "named":
        progress(f"the experiment ended with a trip ({trips[-1]}) and gave no name; the first diagnosis is kept")
        return Repair((bundle, second), (first,), tuple(trips))
    return Repair((bundle, second), (first, again), tuple(trips))


def run(config: Any, bundle: Path, seconds: float, say: Say = lambda text: None) -> dict[str, Any]:
    """Summary of one recording as by `rtctl run`. Raises UserError where it cannot start, RunFailed where it fails."""
    from rtctl.daemon.session import Session, whole

    return whole(Session(config, bundle, seconds, arm=True, say=say).run())


def between(owner: Model, after: Model) -> list[tuple[str, str, str]]:
    """Rows (key, nominal value, new value) of the keys of the config that a model changes, the terms last."""
    rows = []
    for name, value in after.base.items():
        was = owner.base.get(name)
        if was is None or abs(value - was) > NEGLIGIBLE * max(abs(was), abs(value)):
            rows.append((f"plant.parameters.{name}", "-" if was is None else f"{was:.4g}", f"{value:.4g}"))
    return rows + played.terms(after.terms, len(owner.terms))
