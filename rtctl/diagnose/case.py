"""What the owner of a machine believes of it: case.json of a bundle, checked.

A value that cannot be is an error that names its key. A key or a name that this program does not know is a warning:
case.json is written by many hands. Terms that the owner's model does not have are absent or 0.

Source: the exchange format for recordings of two-reel units, linear drives and axes (docs/bundle.md).
"""

import math
from pathlib import Path
from typing import Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rtctl.config.complaints import sentences
from rtctl.config.errors import UserError, nearest
from rtctl.diagnose.config_law import ConfigLaw, UnsaidLaw, config_law
from rtctl.diagnose.quantities import EFFORT, Quantities, quantities, settings_in
from rtctl.idiom import Settings
from rtctl.own.files import refuse_plant
from rtctl.plants import axis, ivu, ldu

MAX_SECTIONS = 8
DAMPING = math.sqrt(0.5)  # of a drive of which the owner says nothing

PARAMETERS: dict[str, type[Settings]] = {
    "ivu": ivu.IvuParameters,
    "ldu": ldu.LduParameters,
    "axis": axis.AxisParameters,
}
DERIVED = {"ivu": (), "ldu": ("N",), "axis": ()}  # follow from others; taken where they are given
OTHER_NAMES: dict[str, dict[str, str]] = {
    "ivu": {},
    "ldu": {},
    "axis": {"J": "M", "K_m": "K"},
}  # a rotary axis: J, rad, Nm
TERMS = {  # parameters that are terms of their own: absent means 0
    "ivu": ("d_tape", "tau_F1", "tau_F2", "tau_Fc"),
    "ldu": ("F_c", "B_c", "B_m", "K_m2"),
    "axis": ("F_v", "F_c", "k"),
}
FROM_ELSEWHERE = ("config", "seed", "versions", "run", "timing", "changes", "rows", "losses", "complete",
                  "recorded_at", "part", "parts", "repaired", "discarded_bytes", "recording_error")  # fmt: skip
KEYS = (
    "format", "plant", "sample_rate", "parameters", "sensors", "drive", "delay_samples", "controller",
    "controller_known", "reaches", "notes",
)  # fmt: skip


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True, allow_inf_nan=False)


class Sensors(_Part):
    capstan_counts_per_rev: float | None = Field(None, gt=0)
    reel_counts_per_rev: float | None = Field(None, gt=0)
    encoder_counts_per_rev: float | None = Field(None, gt=0)
    scale_m_per_count: float | None = Field(None, gt=0)
    x_counts_per_rev: float | None = Field(None, gt=0)
    x_resolution_m: float | None = Field(None, ge=0)
    unit: Literal["m", "rad", "V"] | None = None  # of x
    column: str | None = None  # that holds x


class Drive(_Part):
    amp_per_volt: tuple[float, ...] = ()
    limit_volt: float | None = Field(None, gt=0)
    dac_bits: int | None = Field(None, ge=2, le=32)
    dac_range_volt: float = Field(10.0, gt=0)
    bandwidth_hz: float | None = Field(None, gt=0)
    damping: float | None = Field(None, gt=0)
    current_limit: float | None = Field(None, gt=0)  # A
    newton_per_volt: float | None = Field(None, gt=0)
    newton_metre_per_ampere: float | None = Field(None, gt=0)
    newton_metre_per_volt: float | None = Field(None, gt=0)
    column: str | None = None  # what the recorded command is called at its origin
    unit: Literal["V", "A", "N", "Nm"] = "V"  # of the command

    @property
    def late(self) -> float:
        """Delay in s by which a second-order low pass of this bandwidth holds back what is slow; 0 where the owner says
        nothing of it."""
        if self.bandwidth_hz is None:
            return 0.0
        return 2 * (self.damping or DAMPING) / (2 * math.pi * self.bandwidth_hz)

    @property
    def step_volt(self) -> float | None:
        """One step of the DAC in V."""
        return None if self.dac_bits is None else 2 * self.dac_range_volt / 2**self.dac_bits


class PdLaw(_Part):
    """u_c = P e + D d + friction sign(ref step) + w, shared between the two motors of the ivu."""

    kind: Literal["pd"] = "pd"
    P: float
    D: float
    derivative_filter_hz: float | None = Field(None, gt=0)
    tension_N: float = 0.0
    friction_Nm: float = 0.0
    allocation: Literal["pull", "differential", "motor1", "motor2"] = "pull"


class SectionsLaw(_Part):
    """u = sections(e) + w; each section is (b0, b1, b2, a1, a2). `kind` is what the owner calls it."""

    kind: str
    sections: tuple[tuple[float, float, float, float, float], ...] = Field(min_length=1, max_length=MAX_SECTIONS)


class CascadeLaw(_Part):
    """u = kp kv (ref - x) - kv v + w."""

    kind: Literal["cascade_p_v"] = "cascade_p_v"
    kp: float
    kv: float


class NoLaw(_Part):
    """Driven open loop: the recorded command is the input."""

    kind: Literal["none"] = "none"


class UnknownLaw(_Part):
    kind: str = "unknown"


Law = PdLaw | SectionsLaw | CascadeLaw | ConfigLaw | NoLaw | UnknownLaw
KNOWN_LAWS = (PdLaw, SectionsLaw, CascadeLaw, ConfigLaw)  # that can be computed


class Reaches(_Part):
    parameter_tolerance: float | None = Field(0.15, ge=0)  # None: the values say nothing
    radius_tolerance: float | None = Field(None, ge=0)  # None: as the other parameters


class Case(NamedTuple):
    plant: str
    sample_rate: float | None  # Hz; None: rows at uneven times
    parameters: dict[str, float]  # as given, SI, by the names of the plant's model
    sensors: Sensors
    drive: Drive
    delay_samples: float
    controller: Law
    controller_known: bool  # False: the recorded command is the input
    reaches: Reaches
    notes: str
    warnings: tuple[str, ...]
    file: Path = Path("case.json")
    unsaid: str = ""  # why a law that the owner knows cannot be recomputed from `controller`; "" where it can

    @property
    def estimated(self) -> tuple[str, ...]:
        """Parameters of an axis that the recording gives, since case.json does not: M with F_v and k, and K beside M.

        An estimate is a start of the fit and no belief: it has no tolerance.
        """
        if self.plant != "axis":
            return ()
        if "M" not in self.parameters:
            return tuple(name for name in ("M", "F_v", "k") if name not in self.parameters)
        return () if "K" in believed(self) else ("K",)

    def tolerance(self, name: str) -> float:
        """Share by which a nominal value may be wrong; inf where it may be anything, as an estimated one may."""
        if name in self.estimated:
            return math.inf
        r = self.reaches
        if name == "R_c" and self.plant == "ivu":
            return 0.0
        if name.startswith("R") and r.radius_tolerance is not None:
            return r.radius_tolerance
        return math.inf if r.parameter_tolerance is None else r.parameter_tolerance


def read_case(case: dict[str, Any], folder: Path | str) -> Case:
    """The checked case of the bundle in `folder`. Raises UserError that names the key and what would be right."""
    where = Path(folder) / "case.json"
    plant = case.get("plant")
    if not isinstance(plant, str) or plant not in PARAMETERS:
        hint = nearest(str(plant), PARAMETERS)
        raise UserError(f"{where}: plant is {plant!r}; it should be ivu, ldu or axis" + _or(hint))
    refuse_plant(case.get("config"), f"{where}: config.")
    warnings = [_strange(where, key, "", KEYS) for key in case if key not in (*KEYS, *FROM_ELSEWHERE)]
    rate = _number(where, "sample_rate", case.get("sample_rate"))
    if rate is not None and rate <= 0:
        raise UserError(f"{where}: sample_rate is {rate:g}; it should be above 0 Hz, or null where the clock is uneven")
    delay = _number(where, "delay_samples", case.get("delay_samples"))
    if delay is None:
        delay = 0.0 if plant == "axis" else 1.0
        if plant != "axis":
            warnings.append(f"{where}: delay_samples is missing; 1 is taken")
    if not 0 <= delay <= 100:
        raise UserError(f"{where}: delay_samples is {delay:g}; it should be between 0 and 100")
    sensors = _part(where, "sensors", Sensors, case.get("sensors"), warnings)
    drive = _part(where, "drive", Drive, _listed(case.get("drive")), warnings)
    _check_gains(where, plant, drive)
    own = config_law(case.get("config"))
    if isinstance(own, ConfigLaw):
        controller: Law = own
    elif isinstance(own, UnsaidLaw):
        controller = UnknownLaw(kind=own.kind)
    else:
        controller = _controller(where, plant, case.get("controller"), rate, warnings)
    known = case.get("controller_known", not isinstance(controller, UnknownLaw))
    if not isinstance(known, bool):
        raise UserError(f"{where}: controller_known is {known!r}; it should be true or false")
    unsaid = ""
    if isinstance(own, UnsaidLaw):
        known, unsaid = (
            False,
            f"the law of the config has {', '.join(own.parts)}, which the simulation of a diagnosis does not compute",
        )
    elif known and isinstance(controller, UnknownLaw):
        known, unsaid = False, f"a law of kind '{controller.kind}' cannot be recomputed on this plant"
    notes = case.get("notes")
    reaches = _part(where, "reaches", Reaches, case.get("reaches"), warnings)
    if case.get("parameters") and "parameter_tolerance" not in reaches.model_fields_set:
        share = reaches.parameter_tolerance
        warnings.append(f"{where}: reaches.parameter_tolerance is missing; {share} is taken for what parameters say")
    return Case(
        plant=plant,
        sample_rate=rate,
        parameters=_parameters(where, plant, case.get("parameters"), quantities(sensors.unit, drive.unit), warnings),
        sensors=sensors,
        drive=drive,
        delay_samples=delay,
        controller=controller,
        controller_known=known,
        reaches=reaches,
        notes=notes if isinstance(notes, str) else "",
        warnings=tuple(warnings),
        file=where,
        unsaid=unsaid,
    )


def believed(case: Case) -> dict[str, float]:
    """Every parameter of the plant's model, SI, as the owner believes it.

    A term that the owner does not have is 0, what else is absent is the model's own value; J_1, J_2 follow from the
    radii (4.1, 4.2) and N from R_t / R_s. For an axis M is missing from the answer where nobody knows it, and K, the
    force for one unit of the recorded command, comes from `drive` where `parameters` do not say.
    """
    given = case.parameters
    drive = case.drive
    if case.plant == "axis":
        gain = drive.newton_per_volt or drive.newton_metre_per_ampere or drive.newton_metre_per_volt
        gain = gain or (1.0 if drive.unit in EFFORT else None)  # the command is the force or the torque itself
        full = dict.fromkeys(TERMS["axis"], 0.0)
        return {**full, **({"K": gain} if gain else {}), **given}
    own = {k: v for k, v in given.items() if k not in DERIVED[case.plant]}
    absent = {name: 0.0 for name in TERMS[case.plant] if name not in own}
    if case.plant == "ivu":
        model: Settings = ivu.parameters(ivu.IvuSettings(parameters=ivu.IvuParameters(**{**absent, **own})))
        return {k: float(v) for k, v in model.model_dump().items()}
    model = ldu.LduParameters(**{**absent, **own})
    values = {k: float(v) for k, v in model.model_dump().items()}
    return {**values, "N": given.get("N", values["R_t"] / values["R_s"])}


def _parameters(where: Path, plant: str, given: Any, units: Quantities, warnings: list[str]) -> dict[str, float]:
    if given is None:
        given = {}
    if not isinstance(given, dict):
        raise UserError(f"{where}: parameters is a {type(given).__name__}; it should be an object of names and numbers")
    model = settings_in(PARAMETERS[plant], units) if plant == "axis" else PARAMETERS[plant]
    known = (*model.model_fields, *DERIVED[plant], *OTHER_NAMES[plant])
    values: dict[str, float] = {}
    written: dict[str, Any] = {}  # own name -> as the owner writes it
    for name, value in given.items():
        if name not in known:
            warnings.append(_strange(where, name, "parameters.", known))
            continue
        number = _number(where, f"parameters.{name}", value)
        if number is None:
            continue
        own = OTHER_NAMES[plant].get(str(name), str(name))
        if own in values:
            both = f"parameters.{written[own]} and parameters.{name}"
            raise UserError(f"{where}: {both} are one and the same; give one of them")
        values[own], written[own] = number, name
        if own in DERIVED[plant]:
            if number <= 0:
                raise UserError(f"{where}: parameters.{name} is {number:g}; it should be above 0")
            continue
        try:
            model(**{own: number})
        except ValidationError as error:
            said = sentences(error, model, {own: number}).removeprefix(f"{own}: ")
            raise UserError(f"{where}: parameters.{name}: {said}") from None
    absent = [n for n in model.model_fields if n not in (*values, *TERMS[plant], "J_1", "J_2", "M", "K")]
    if absent:
        warnings.append(f"{where}: parameters does not say {', '.join(absent)}; the model's own values are taken")
    return values


def _controller(where: Path, plant: str, given: Any, rate: float | None, warnings: list[str]) -> Law:
    if given is None:
        warnings.append(f"{where}: controller is missing; the recorded command is taken as the input")
        return UnknownLaw()
    if not isinstance(given, dict):
        raise UserError(f"{where}: controller is a {type(given).__name__}; it should be an object with a 'kind'")
    kind = given.get("kind", "unknown")
    if not isinstance(kind, str):
        raise UserError(f"{where}: controller.kind is {kind!r}; it should be a word, such as pd")
    if kind == "none":
        return NoLaw()
    if plant == "ivu" and kind == "pd":
        return _part(where, "controller", PdLaw, given, warnings)
    if plant == "axis" and kind == "cascade_p_v":
        return _part(where, "controller", CascadeLaw, {k: v for k, v in given.items() if k != "law"}, warnings)
    if plant != "ivu" and given.get("sections") is not None:
        return _part(where, "controller", SectionsLaw, {"kind": kind, "sections": given["sections"]}, warnings)
    if plant != "ivu" and kind == "pd" and rate is not None and "P" in given and "D" in given:
        law: PdLaw = _part(where, "controller", PdLaw, given, warnings)
        section = pd_section(law.P, law.D, law.derivative_filter_hz, 1 / rate)
        return _part(where, "controller", SectionsLaw, {"kind": "pd", "sections": [section]}, warnings)
    return UnknownLaw(kind=kind)


def pd_section(P: float, D: float, filter_hz: float | None, dt: float) -> tuple[float, float, float, float, float]:
    """P e + D d with d += a ((e - e_prev) / dt - d) as one section (b0, b1, b2, a1, a2)."""
    a = 1.0 if filter_hz is None else 1.0 - math.exp(-2 * math.pi * filter_hz * dt)
    d = D * a / dt
    return (P + d, -P * (1.0 - a) - d, 0.0, -(1.0 - a), 0.0)


def _check_gains(where: Path, plant: str, drive: Drive) -> None:
    wanted = {"ivu": 2, "ldu": 1, "axis": 0}[plant]
    gains = drive.amp_per_volt
    if wanted and len(gains) != wanted:
        raise UserError(f"{where}: drive.amp_per_volt has {len(gains)} values; it should have {wanted}, one a drive")
    if any(gain <= 0 for gain in gains):
        raise UserError(f"{where}: drive.amp_per_volt is {list(gains)}; each should be above 0 A/V")


def _listed(drive: Any) -> Any:
    if isinstance(drive, dict) and isinstance(drive.get("amp_per_volt"), int | float):
        return {**drive, "amp_per_volt": [drive["amp_per_volt"]]}
    return drive


def _part(where: Path, name: str, model: type, given: Any, warnings: list[str]) -> Any:
    if given is None:
        given = {}
    if not isinstance(given, dict):
        raise UserError(f"{where}: {name} is a {type(given).__name__}; it should be an object {{...}}")
    warnings += [_strange(where, k, name + ".", model.model_fields) for k in given if k not in model.model_fields]  # type: ignore[attr-defined]
    if name == "reaches":
        for key, value in given.items():
            _number(where, f"reaches.{key}", value)
    try:
        return model(**given)
    except ValidationError as error:
        raise UserError(sentences(error, model, given, lambda path: f"{where}: {name}").splitlines()[0]) from None


def _number(where: Path, key: str, value: Any) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise UserError(f"{where}: {key} is {value!r}; it should be a number in SI units")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise UserError(f"{where}: {key} is {value}; it should be a finite number")
    return number


def _strange(where: Path, name: str, before: str, known: Any) -> str:
    return f"{where}: {before}{name} is not a key that this program knows; it is left out" + _or(nearest(name, known))


def _or(hint: str | None) -> str:
    return f" (is it '{hint}'?)" if hint else ""
