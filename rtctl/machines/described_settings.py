"""Settings of a machine that its config describes: bodies, joints, drives and sensors, and the loop around them.

The law's units follow from the description: the unit of the sensor that the loop closes on, and that of the drive's
command.
"""

import keyword
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Annotated, Any, Literal

from pydantic import Field, create_model, model_validator

from rtctl.config.errors import nearest
from rtctl.config.unit_change import with_units
from rtctl.config.units import to_si
from rtctl.drivers.board import EmulatedSettings
from rtctl.drivers.boards import BusSettings
from rtctl.idiom import Settings, quantity
from rtctl.laws.bumpless import BumplessSettings
from rtctl.laws.excitation import ExcitationSettings, NoneSettings
from rtctl.laws.limit import LimitSettings
from rtctl.laws.reference import ReferenceSettings
from rtctl.laws.shaper import ShaperSettings
from rtctl.laws.state_feedback import StateFeedbackSettings
from rtctl.laws.velocity import VelocitySettings
from rtctl.machines.base import COMMON_COLUMNS, MachineSettings
from rtctl.machines.compensation import CompensationSettings, in_units
from rtctl.machines.ldu import PdLawSettings, PiLawSettings, SectionsLawSettings
from rtctl.machines.physics import PhysicsTerm
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.elements import check_node
from rtctl.plants.graph.units import measured_unit
from rtctl.tick.safety import SafetySettings

SIGNALS = ("target", "ref", "w", "feedback", "position_error", "speed", "u_c")  # of the loop, in the trace
FEEDBACK = ("position", "speed")  # quantities that a loop can close on, in order of preference
FULL = 10.0  # command units, range of the command where neither limit nor converter gives it


class StateFeedbackLawSettings(StateFeedbackSettings):
    """State feedback from an observer of the whole machine, as `rtctl tune --method lq` designs it."""

    kind: Literal["state_feedback"] = "state_feedback"


PositionSettings = Annotated[
    PiLawSettings | PdLawSettings | SectionsLawSettings | StateFeedbackLawSettings, Field(discriminator="kind")
]


class DescribedLawSettings(Settings):
    """The law, block by block in the order of the tick."""

    feedback: str | None = Field(
        default=None, description="sensor that the loop closes on; the first of a body's position, else speed"
    )
    drive: str | None = Field(default=None, description="drive that the law commands; the first if absent")
    shares: dict[str, float] = Field(
        default={}, description="share of the command that other drives get, by name; 0 if absent"
    )
    shaper: ShaperSettings = ShaperSettings()
    position: PositionSettings = PdLawSettings(gain=0.0)  # no motion; `rtctl tune` designs a law
    limit: LimitSettings = LimitSettings()
    bumpless: BumplessSettings = BumplessSettings()
    velocity: VelocitySettings = VelocitySettings()
    compensation: CompensationSettings = CompensationSettings()


class DescribedPlantSettings(Settings):
    """The emulated machine."""

    rate: float | None = quantity(None, unit="Hz", gt=0, help="rate of the emulator in real mode; the loop's if absent")
    substep: float = quantity(1e-3, unit="s", gt=0, le=1e-2, help="longest integration step")
    physics: list[PhysicsTerm] = Field(default=[], description="terms of physics beyond the description")


class DescribedConfig(MachineSettings):
    """Any machine: bodies, joints, drives and sensors, and one loop around them."""

    machine: Description
    driver: BusSettings = Field(  # a description names no channels of a card
        default=EmulatedSettings(), description="the board: emulated with the machine, or drives on a bus"
    )
    law: DescribedLawSettings = DescribedLawSettings()
    reference: ReferenceSettings = ReferenceSettings()
    excitation: ExcitationSettings = NoneSettings()
    plant: DescribedPlantSettings = DescribedPlantSettings()

    @model_validator(mode="after")
    def _fits(self) -> "DescribedConfig":
        machine, law = self.machine, self.law
        if not machine.drives:
            raise ValueError("machine.drives is missing: a loop needs a drive to command; describe one")
        if feedback_name(machine, law.feedback) is None:
            raise ValueError("machine.sensors: no sensor shows the position or speed of a body; a loop closes on one")
        _known("law.feedback", law.feedback, _closable(machine), "sensor of a body's position or speed")
        _known("law.drive", law.drive, list(machine.drives), "drive")
        for name in law.shares:
            _known(f"law.shares.{name}", name, list(machine.drives), "drive")
        _check_columns(machine)
        for i, term in enumerate(self.plant.physics):
            check_node(machine, f"plant.physics.{i}.node", term.term, term.node)
        feedforward = law.compensation.feedforward
        for i, entry in enumerate(feedforward.effects if feedforward is not None else ()):
            path = f"law.compensation.feedforward.effects.{i}.effect.node"
            check_node(machine, path, entry.effect.term, entry.effect.node)
        return self


def feedback_name(machine: Description, wanted: str | None) -> str | None:
    """Sensor that the loop closes on; None where no sensor is suitable."""
    names = _closable(machine)
    return wanted if wanted is not None else names[0] if names else None


def drive_name(machine: Description, wanted: str | None) -> str:
    """Drive that the law commands."""
    return wanted if wanted is not None else next(iter(machine.drives))


def units_of(data: Any) -> tuple[str, str, float]:
    """Unit of the feedback, unit of the command, and its largest value, of plain data that may be wrong."""
    machine, law = _mapping(_mapping(data).get("machine")), _mapping(_mapping(data).get("law"))
    bodies, sensors, drives = (_mapping(machine.get(key)) for key in ("bodies", "sensors", "drives"))
    found = [
        name for kind in FEEDBACK for name, s in sensors.items()
        if _mapping(s).get("measures", "position") == kind and _mapping(s).get("body") is not None
    ]  # fmt: skip
    sensor = _mapping(sensors.get(str(law.get("feedback") or (found[0] if found else ""))))
    drive = _mapping(drives.get(str(law.get("drive") or next(iter(drives), ""))))
    measures = sensor.get("measures", "position")
    body = _mapping(bodies.get(str(sensor.get("body"))))
    way = measured_unit(measures if measures in FEEDBACK else "position", body.get("mass") is None)
    command = drive.get("unit", "V")
    command = {"%": "percent"}.get(command, command) if isinstance(command, str) else "V"
    full = FULL
    for key in ("dac_range", "limit"):
        try:
            full = abs(float(to_si(drive.get(key, full), command))) or full
        except (TypeError, ValueError):  # reported when the config is validated
            continue
    return way, command, full


def config_class(data: Any) -> type[DescribedConfig]:
    """Settings class in the units of the machine that plain data describe."""
    return _config_class(*units_of(data))


@lru_cache(maxsize=64)
def _config_class(way: str, command: str, full: float) -> type[DescribedConfig]:
    symbols = {"V": command, "rad": way, "m": way}
    limits, laws = with_units(LimitSettings, symbols), with_units(DescribedLawSettings, symbols)
    shaper = DescribedLawSettings.model_fields["shaper"]  # its bandwidth is in rad/s for every machine
    fields: dict[str, Any] = {"limit": (limits, limits(high=full)), "shaper": (ShaperSettings, shaper)}
    around = in_units(symbols)
    fields["compensation"] = (around, around())
    law: Any = create_model("DescribedLawSettings", __base__=laws, __module__=__name__, __doc__=laws.__doc__, **fields)
    safety, reference = with_units(SafetySettings, symbols), with_units(ReferenceSettings, symbols)
    played = with_units(DescribedConfig, symbols).model_fields["excitation"]
    fields = {
        "law": (law, law()),
        "safety": (safety, safety(frozen_effort=0.5 * full, current_time=0.0)),
        "reference": (reference, reference()),
        "excitation": (played.annotation, played),
    }
    made: Any = create_model(
        "DescribedConfig", __base__=DescribedConfig, __module__=__name__, __doc__=DescribedConfig.__doc__, **fields
    )
    return made


def _closable(machine: Description) -> list[str]:
    """Sensors that a loop can close on, positions first."""
    return [
        name for kind in FEEDBACK for name, s in machine.sensors.items() if s.measures == kind and s.body is not None
    ]


def _known(path: str, name: str | None, known: list[str], what: str) -> None:
    if name is not None and name not in known:
        near = nearest(name, known)
        raise ValueError(
            f"{path}: there is no {what} '{name}'; "
            + (f"did you mean '{near}'?" if near else f"there is {', '.join(known)}")
        )


def _columns(machine: Description) -> Iterator[tuple[str, str]]:
    for group in ("drives", "sensors"):
        for name, element in getattr(machine, group).items():
            yield f"machine.{group}.{name}.column", element.column


def _check_columns(machine: Description) -> None:
    taken = {*SIGNALS, *(column.name for column in COMMON_COLUMNS)}
    for path, column in _columns(machine):
        if not (column.isidentifier() and column.isascii()) or keyword.iskeyword(column):
            raise ValueError(
                f"{path}: '{column}' is no name of a signal; write letters, digits and _, as in motor_counts"
            )
        if column in taken or column.startswith("truth_"):
            raise ValueError(f"{path}: '{column}' is a signal of the loop itself; take another, such as {column}_read")


def _mapping(value: Any) -> Mapping[Any, Any]:
    return value if isinstance(value, Mapping) else {}
