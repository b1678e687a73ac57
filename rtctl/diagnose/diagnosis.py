"""What a diagnosis says, and its form in diagnosis.json."""

from typing import Any, NamedTuple

from rtctl.diagnose.model import Model
from rtctl.diagnose.preflight import Preflight
from rtctl.diagnose.record import Record

NAMED, AMBIGUOUS, UNNAMED, NOTHING = "named", "ambiguous", "unnamed", "nothing"


class Interval(NamedTuple):
    value: float
    low: float  # of the 90 % interval
    high: float
    unit: str = ""

    def as_json(self) -> dict[str, Any]:
        """Value, ends of the interval and unit, as in diagnosis.json."""
        return {"value": self.value, "ci90": [self.low, self.high], "unit": self.unit}


class Rival(NamedTuple):
    """A look-alike of an effect that was fitted in its place."""

    name: str
    node: str
    p_value: float  # of explaining the record as well
    rms: float  # of its weighted error


class Effect(NamedTuple):
    """A term of physics that the record asks for."""

    name: str
    node: str
    confidence: float
    parameters: dict[str, Interval]
    look_alikes: tuple[Rival, ...]
    instead_of: str | None = None  # term:node of the effect before it whose place it would take; None: it stands itself


class Located(NamedTuple):
    """Where simulation and recording part."""

    channel: str
    node: str
    axis: str
    where: str  # in words
    since_s: float
    share: float  # of the error that lives there


class Evidence(NamedTuple):
    """One hypothesis of the first screening, or one fitted combination."""

    names: tuple[str, ...]  # term:node
    gain: float  # share of the excess error that it explains, 0 to 1
    fitted: bool


class Diagnosis(NamedTuple):
    record: Record
    preflight: Preflight
    verdict: str
    effects: tuple[Effect, ...]
    located: Located | None
    parameters: dict[str, Interval]
    owner: Model
    before: Model  # the owner's equations with parameters fitted
    after: Model  # with what was found
    heldout_before: float  # nrmse on rows that no fit saw
    heldout_after: float
    noise_floor: float
    evidence: tuple[Evidence, ...]
    null_line: float  # gain that a hypothesis reaches on a record with nothing in it
    cannot_test: tuple[str, ...]
    hides: dict[str, Interval]  # term:node -> smallest size that this record would have shown, by its main parameter
    experiment: dict[str, Any] | None
    fit_rows: tuple[int, int]  # first and last row fitted
    seconds: float
    on_track: bool = False  # whether the rows that no fit saw were predicted there, since a free run ran away
    left_out: tuple[str, ...] = ()  # numbers that were found and are not in `after`, and why
    untestable: tuple[str, ...] = ()  # term:node that fits best and cannot be tested: the reason for `unnamed`
    unpredicted: bool = False  # nothing was found, and a free run is further off than noise and uncertainty make it
    random_forces: bool = False  # whether what is left is of forces without a pattern, beside the noise of the sensor
    faint: bool = False  # whether what was found is less than random forces do, and shows in errors made white
    resembles: tuple[str, str] | None = None  # term that the table has no name for and its node, where it explains more


def as_json(d: Diagnosis) -> dict[str, Any]:
    """diagnosis.json, exactly in the form of the exchange format, with what it does not forbid beside it."""
    return {
        "verdict": d.verdict,
        "effects": [
            {
                "name": e.name,
                "node": e.node,
                "confidence": round(e.confidence, 4),
                "parameters": {k: v.as_json() for k, v in e.parameters.items()},
                "look_alikes": [{"name": r.name, "node": r.node, "p_value": r.p_value} for r in e.look_alikes],
            }
            for e in d.effects
        ],
        "located": None if d.located is None else d.located._asdict(),
        "parameters": {k: {"value": v.value, "ci90": [v.low, v.high]} for k, v in d.parameters.items()},
        "fit": {
            "heldout_nrmse_before": d.heldout_before,
            "heldout_nrmse_after": d.heldout_after,
            "noise_floor": d.noise_floor,
        },
        "random_forces": d.random_forces,
        "faint": d.faint,
        "untestable": list(d.untestable),
        "unpredicted": d.unpredicted,
        "resembles": None if d.resembles is None else dict(zip(("name", "node"), d.resembles, strict=True)),
        "cannot_test": list(d.cannot_test),
        "hides": {k: {"value": v.value, "unit": v.unit} for k, v in d.hides.items()},
        "separating_experiment": d.experiment,
        "warnings": list(d.record.case.warnings),
        "seconds": round(d.seconds, 2),
    }
