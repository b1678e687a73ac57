"""From a running machine to a better model of it: record, diagnose, where two answers are left run the experiment that
separates them and diagnose again, write the model.

What is recorded is an ordinary run (`rtctl run`), so the bundles are there to be looked at and diagnosed again.
"""

import math
import re
import textwrap
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import set_path, to_yaml
from rtctl.diagnose.diagnosis import AMBIGUOUS, Diagnosis
from rtctl.diagnose.numbers import span
from rtctl.diagnose.ordinary import USE
from rtctl.diagnose.results import EXPERIMENT

LENGTH = {"ivu": 25.0, "ldu": 10.0, "axis": 25.0}  # s, of a recording
RECORDING, SECOND = "recording", "experiment"  # bundles in the folder of a repair
WIDTH = 110
PAIR = re.compile(r"- - (\S+)\n +- (\S+)$(?!\n +- [^-])", re.M)  # a knot over two lines
PLAYED = ("reference", "excitation")  # keys of a config that say what a machine is made to do
NEGLIGIBLE = 1e-4  # share of a value below which it has not changed
LEGS = (  # (share of the travel, share of the speed): far and fast, and at a crawl where friction shows itself
    (0.5, 1.0), (0.45, 0.05), (-0.3, 1.0), (-0.27, 0.1), (0.2, 0.5), (0.17, 0.05), (0.0, 0.7),
)  # fmt: skip
DWELL = 0.5  # s

Say = Callable[[str], None]


class Repair(NamedTuple):
    """What a machine taught: recordings and diagnoses in order; the last one counts."""

    bundles: tuple[Path, ...]
    diagnoses: tuple[Diagnosis, ...]
    trips: tuple[str, ...]  # of the recordings: "" for none

    @property
    def last(self) -> Diagnosis:
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
    return set_path(config, "reference", ordinary_reference(config.machine))


def ordinary_reference(kind: str) -> dict[str, Any]:
    """To and fro at several speeds with rests in between, within what the machine is used to and the usual recording;
    rad or m, and s."""
    speed, travel, _ = USE[kind]
    shares = [0.0, *(share for share, _ in LEGS)]
    moving = sum(abs(b - a) / pace for (a, b), (_, pace) in zip(pairwise(shares), LEGS, strict=True)) * travel / speed
    travel *= min(1.0, (LENGTH[kind] - DWELL * (len(LEGS) + 1)) / moving)
    steps, t, at = [], DWELL, 0.0
    for share, pace in LEGS:
        to, rate = share * travel, pace * speed
        steps.append({"at": round(t, 3), "to": round(to, 9), "ramp": round(rate, 9)})
        t += abs(to - at) / rate + DWELL
        at = to
    return {"steps": steps, "repeat": round(t, 3)}


def repair(
    config: Any,
    out: Path,
    length: float | None = None,
    progress: Say = lambda text: None,
    record: Callable[[Any, Path, float], dict[str, Any]] | None = None,
    diagnose: Callable[[Path, Path | None, Say], Diagnosis] | None = None,
) -> Repair:
    """Record the machine of a config that is `ready` into bundles in `out`, and diagnose it.

    `record` runs the machine (see `run`), `diagnose` is the chain. Raises UserError and NoAnswer as these do; what
    becomes of the experiment cannot undo the first diagnosis.
    """
    from rtctl.diagnose import chain

    run_, diagnose = record or run, diagnose or chain.diagnose
    seconds = LENGTH[config.machine] if length is None else length
    bundle = out / RECORDING
    progress(f"recording {seconds:g} s")
    trips = [run_(config, bundle, seconds)["tripped"] or ""]
    if trips[0]:
        progress(f"the run ended early, with a trip: {trips[0]}")
    first = diagnose(bundle, None, progress)
    if first.verdict != AMBIGUOUS or first.experiment is None:
        return Repair((bundle,), (first,), tuple(trips))
    names = " or ".join(dict.fromkeys(e.name for e in first.effects))
    second = out / SECOND
    played, seconds = _played(config, first.experiment, seconds)
    progress(f"{names}: recording the experiment that separates them, {seconds:g} s")
    trips.append(run_(played, second, seconds)["tripped"] or "")
    try:
        again = diagnose(second, None, progress)
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


def _played(config: Any, experiment: dict[str, Any], seconds: float) -> tuple[Any, float]:
    """The config that plays an experiment, and how long that takes."""
    for key in PLAYED:
        if experiment.get(key) is not None:
            given = {name: value for name, value in experiment[key].items() if name != "unit"}  # that of the machine
            config = set_path(config, key, _plain(given))
    return config, float(experiment.get("seconds") or seconds)


def experiment_yaml(d: Diagnosis, config: dict[str, Any] | None = None) -> str:
    """The separating experiment as a config that `rtctl run` takes as it is: the machine's own, playing what it says.

    `config` is what case.json of our own recordings holds. Raises UserError where the two do not go together.
    """
    from rtctl import machines
    from rtctl.config.fields import Shape, fill
    from rtctl.diagnose.export import to_config

    assert d.experiment is not None
    kind = machines.CONFIGS[d.record.plant]
    data = config if config is not None else to_config(d.owner, d.record)
    settings = kind.model_validate(fill(Shape(kind, model=kind), _plain(data)))
    settings, seconds = _played(settings, d.experiment, d.record.dt * len(d.record.t))
    if config is None:  # all of it is emulated, and needs no clock to be right
        settings = set_path(settings, "loop.mode", "fused")
    return _head(d, seconds, config is not None) + PAIR.sub(r"- [\1, \2]", to_yaml(settings))


def _head(d: Diagnosis, seconds: float, own: bool) -> str:
    """Comment lines on top of an experiment's file: what it does, what for, and how to run it."""
    assert d.experiment is not None
    given = d.experiment.get("why")
    why: dict[str, Any] = given if isinstance(given, dict) else {"words": given}
    told = [
        f"The experiment to run next. {d.experiment.get('words') or ''}",
        why.get("words") or f"It tells {' from '.join(dict.fromkeys(e.name for e in d.effects))}.",
        f"Put the machine where the recording began{room(d.experiment)}, run `{command(seconds)}` and diagnose that "
        "recording.",
    ]
    if not own:
        told.append(
            "The recording is not ours, so what is here beside the reference is a stand-in for its controller: play "
            "the reference on your own."
        )
    lines = [line for words in told for line in wrapped(" ".join(str(words).split()))]
    distances = sorted(why.get("distance", {}).items(), key=lambda item: -item[1])
    if distances:
        lines.append("Expected distance between the rivals, over the noise, of all motions that were tried:")
        lines += [f"    {name:18} {value:.3g}" for name, value in distances]
        lines += [f"    {name:18} left out: {reason}" for name, reason in why.get("refused", {}).items()]
    return "".join(f"# {line}\n" for line in lines)


def wrapped(text: str) -> list[str]:
    """Lines of a comment; what stands in backticks is not broken, so that it can be copied."""
    kept = re.sub("`[^`]*`", lambda found: found[0].replace(" ", "\0"), text)
    return [line.replace("\0", " ") for line in textwrap.wrap(kept, WIDTH, break_on_hyphens=False)]


def command(seconds: float) -> str:
    """What runs an experiment of this length."""
    return f"rtctl run {EXPERIMENT} --for {math.ceil(seconds)}s"


def room(experiment: dict[str, Any]) -> str:
    """How much of it the machine needs, in words; "" where the experiment does not say."""
    travel = experiment.get("limits", {}).get("travel")
    if travel is None:
        return ""
    unit = (experiment.get("reference") or {}).get("unit", "")
    return f", with room of {span(float(travel[0]), float(travel[1]), unit)} around it"


def _plain(value: Any) -> Any:
    """Numbers, words, lists and tables as YAML knows them."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return _plain(value.tolist()) if hasattr(value, "tolist") else value


def changes(d: Diagnosis) -> list[tuple[str, str, str]]:
    """(key, owner's value, new value) of each key of the config that the model changes, the terms last."""
    rows = []
    for name, value in d.after.base.items():
        was = d.owner.base.get(name)
        if was is None or abs(value - was) > NEGLIGIBLE * max(abs(was), abs(value)):
            rows.append((f"plant.parameters.{name}", "-" if was is None else f"{was:.4g}", f"{value:.4g}"))
    known = len(d.owner.terms)
    for number, term in enumerate(d.after.terms[known:], known):
        values = {k: v for k, v in term.model_dump().items() if k not in ("term", "node")}
        shown = ", ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in values.items())
        rows.append((f"plant.physics.{number}", "-", f"{term.term} at {term.node}: {shown}"))  # type: ignore[attr-defined]
    return rows
