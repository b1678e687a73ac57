"""Case of exchange format 1: nominal model of a two-reel unit, a linear drive or an axis, checked.

An impossible value is an error that names its key. An unknown key or name is a warning, because many programs write
case.json. Terms that the nominal model lacks are absent or 0.

Source: docs/bundle.md.
"""

import math
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from rtctl.case.checks import FROM_ELSEWHERE, delay_samples, number, part, perhaps, sample_rate, strange
from rtctl.case.config_law import ConfigLaw, UnsaidLaw, config_law
from rtctl.case.laws import Law, UnknownLaw, controller
from rtctl.case.parts import Drive, Reaches, Sensors
from rtctl.case.quantities import Quantities, quantities, settings_in
from rtctl.config.complaints import sentences
from rtctl.config.errors import UserError, nearest
from rtctl.machines.exchange import Exchange
from rtctl.machines.profile import FREE_UNITS, Profile
from rtctl.machines.profiles import PROFILES, profile_of
from rtctl.own.files import refuse_plant
from rtctl.plants.graph.description import Description
from rtctl.plants.physics.place import PLANTS

KEYS = (
    "format", "plant", "sample_rate", "parameters", "sensors", "drive", "delay_samples", "controller",
    "controller_known", "reaches", "notes",
)  # fmt: skip


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
    unsaid: str = ""  # why a known law cannot be recomputed from `controller`; "" where it can

    @property
    def estimated(self) -> tuple[str, ...]:
        """Parameters of an axis that case.json lacks and the recording gives: M with F_v and k, or K where M is given.

        An estimate is an initial value of the fit, no nominal value, and has no tolerance.
        """
        if not profile_of(self.plant).has(FREE_UNITS):
            return ()
        if "M" not in self.parameters:
            return tuple(name for name in ("M", "F_v", "k") if name not in self.parameters)
        return () if "K" in believed(self) else ("K",)

    def tolerance(self, name: str) -> float:
        """Relative tolerance of a nominal value; inf where it is unlimited or the value is estimated."""
        if name in self.estimated:
            return math.inf
        r = self.reaches
        if name in exchange_of(self.plant).exact:
            return 0.0
        if name.startswith("R") and r.radius_tolerance is not None:
            return r.radius_tolerance
        return math.inf if r.parameter_tolerance is None else r.parameter_tolerance


def read_case(case: dict[str, Any], folder: Path | str) -> Case:
    """Checked case of the bundle in `folder`. Raises UserError that names the key and what would be right."""
    where = Path(folder) / "case.json"
    plant = case.get("plant")
    kinds = [kind for kind, profile in PROFILES.items() if profile.exchange is not None]
    if not isinstance(plant, str) or plant not in kinds:
        hint, names = nearest(str(plant), kinds), f"{', '.join(kinds[:-1])} or {kinds[-1]}"
        raise UserError(f"{where}: plant is {plant!r}; it should be {names}" + perhaps(hint))
    profile, exchange = profile_of(plant), exchange_of(plant)
    refuse_plant(case.get("config"), f"{where}: config.")
    warnings = [strange(where, key, "", KEYS) for key in case if key not in (*KEYS, *FROM_ELSEWHERE)]
    rate, delay = sample_rate(where, case), delay_samples(where, case)
    if delay is None:
        delay = 1.0 if exchange.delay is None else exchange.delay
        if exchange.delay is None:
            warnings.append(f"{where}: delay_samples is missing; 1 is taken")
    sensors = part(where, "sensors", Sensors, case.get("sensors"), warnings)
    drive = part(where, "drive", Drive, _listed(case.get("drive")), warnings)
    _check_gains(where, exchange, drive)
    own = config_law(case.get("config"))
    if isinstance(own, ConfigLaw):
        law: Law = own
    elif isinstance(own, UnsaidLaw):
        law = UnknownLaw(kind=own.kind)
    else:
        law = controller(where, profile, case.get("controller"), rate, warnings)
    known = case.get("controller_known", not isinstance(law, UnknownLaw))
    if not isinstance(known, bool):
        raise UserError(f"{where}: controller_known is {known!r}; it should be true or false")
    unsaid = ""
    if isinstance(own, UnsaidLaw):
        known, unsaid = (
            False,
            f"the law of the config has {', '.join(own.parts)}, which the simulation of a diagnosis does not compute",
        )
    elif known and isinstance(law, UnknownLaw):
        known, unsaid = False, f"a law of kind '{law.kind}' cannot be recomputed on this plant"
    notes = case.get("notes")
    reaches = part(where, "reaches", Reaches, case.get("reaches"), warnings)
    if case.get("parameters") and "parameter_tolerance" not in reaches.model_fields_set:
        share = reaches.parameter_tolerance
        warnings.append(f"{where}: reaches.parameter_tolerance is missing; {share} is taken for the parameters")
    return Case(
        plant=plant,
        sample_rate=rate,
        parameters=_parameters(where, profile, case.get("parameters"), quantities(sensors.unit, drive.unit), warnings),
        sensors=sensors,
        drive=drive,
        delay_samples=delay,
        controller=law,
        controller_known=known,
        reaches=reaches,
        notes=notes if isinstance(notes, str) else "",
        warnings=tuple(warnings),
        file=where,
        unsaid=unsaid,
    )


def exchange_of(plant: str) -> Exchange:
    """Exchange format of a kind of machine. Raises KeyError for an unknown kind."""
    found = profile_of(plant).exchange
    if found is None:
        raise KeyError(plant)
    return found


def machine_of(plant: str) -> Description:
    """Description of a kind of machine that the format knows."""
    return PLANTS[plant].described().layout.machine


def believed(case: Case) -> dict[str, float]:
    """Nominal value of every symbol of the machine, SI; 0 for a term that the nominal model lacks.

    An unknown mass or gain of an axis is missing from the dict.
    """
    return exchange_of(case.plant).believed(case.parameters, case.drive)


def _parameters(where: Path, profile: Profile, given: Any, units: Quantities, warnings: list[str]) -> dict[str, float]:
    if given is None:
        given = {}
    if not isinstance(given, dict):
        raise UserError(f"{where}: parameters is a {type(given).__name__}; it should be an object of names and numbers")
    exchange = profile.exchange
    assert exchange is not None  # read_case
    model = settings_in(exchange.parameters, units) if profile.has(FREE_UNITS) else exchange.parameters
    known = (*model.model_fields, *exchange.derived, *exchange.aliases)
    values: dict[str, float] = {}
    written: dict[str, Any] = {}  # name in the model -> name in the case
    for name, said in given.items():
        if name not in known:
            warnings.append(strange(where, name, "parameters.", known))
            continue
        value = number(where, f"parameters.{name}", said)
        if value is None:
            continue
        own = exchange.aliases.get(str(name), str(name))
        if own in values:
            both = f"parameters.{written[own]} and parameters.{name}"
            raise UserError(f"{where}: {both} are one and the same; give one of them")
        values[own], written[own] = value, name
        if own in exchange.derived:
            if value <= 0:
                raise UserError(f"{where}: parameters.{name} is {value:g}; it should be above 0")
            continue
        try:
            model(**{own: value})
        except ValidationError as error:
            why = sentences(error, model, {own: value}).removeprefix(f"{own}: ")
            raise UserError(f"{where}: parameters.{name}: {why}") from None
    absent = [n for n in model.model_fields if n not in (*values, *exchange.terms, *exchange.silent)]
    if absent:
        warnings.append(f"{where}: parameters does not say {', '.join(absent)}; the model's own values are taken")
    return values


def _check_gains(where: Path, exchange: Exchange, drive: Drive) -> None:
    wanted = exchange.gains
    gains = drive.amp_per_volt
    if wanted and len(gains) != wanted:
        raise UserError(f"{where}: drive.amp_per_volt has {len(gains)} values; it should have {wanted}, one a drive")
    if any(gain <= 0 for gain in gains):
        raise UserError(f"{where}: drive.amp_per_volt is {list(gains)}; each should be above 0 A/V")


def _listed(drive: Any) -> Any:
    if isinstance(drive, dict) and isinstance(drive.get("amp_per_volt"), int | float):
        return {**drive, "amp_per_volt": [drive["amp_per_volt"]]}
    return drive
