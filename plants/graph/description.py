"""Description of a machine: bodies, joints, drives and sensors, as a config or a case.json writes them.

A config may give every number with a unit; the unit that is right follows from whether the body turns (it has an
`inertia`) or slides (it has a `mass`). Numbers without a unit are SI.

Source: exchange format 2 of the program's recordings (docs/machines.md).
"""

from collections.abc import Iterator, Mapping
from typing import Any, Literal

from pydantic import ConfigDict, Field, create_model, model_validator

from rtctl.idiom import Settings
from rtctl.plants.graph import mechanics as coupling
from rtctl.plants.graph.mechanics import MechanicsSettings
from rtctl.plants.graph.units import check_place, in_si

FRAME = "frame"
NAME = r"^[A-Za-z][A-Za-z0-9_-]{0,39}$"


class Gravity(Settings):
    """Weight of a body: a pendulum of `mass` at `arm`, or a slope of `incline`."""

    mass: float | None = Field(None, description="mass off the axis, kg; negative for a counterweight")
    arm: float | None = Field(None, description="distance from the axis, m")
    angle: float = Field(0.0, description="the pendulum hangs at minus this angle, rad")
    incline: float | None = Field(None, description="slope of the way, rad; pi/2 for a vertical axis")

    @model_validator(mode="after")
    def _one(self) -> "Gravity":
        if (self.incline is None) == (self.mass is None and self.arm is None):
            raise ValueError("give mass and arm (a body that turns) or incline (a body that slides)")
        if self.incline is None and (self.mass is None or self.arm is None):
            raise ValueError("mass and arm belong together; give both")
        return self


class Reel(Settings):
    """Reel of tape: `radius` of the body grows as tape lands, and its inertia with it."""

    core: float = Field(gt=0, description="radius of the empty reel, m")
    thickness: float = Field(0.0, ge=0, description="of the tape, m; 0 keeps the radius as it is")
    density: float = Field(0.0, ge=0, description="of the tape, kg/m^3")
    width: float = Field(0.0, ge=0, description="of the tape, m")


class Body(Settings):
    """One coordinate: an angle where `inertia` is given, a displacement where `mass` is."""

    inertia: float | None = Field(None, gt=0, description="moment of inertia, kg m^2; the body turns")
    mass: float | None = Field(None, gt=0, description="mass, kg; the body slides")
    dry: float = Field(0.0, ge=0, description="dry friction to the frame, Nm or N")
    viscous: float = Field(0.0, ge=0, description="viscous friction to the frame, Nms/rad or Ns/m")
    pull: float | None = Field(None, description="constant torque or force on it, Nm or N, as of a slip coupling")
    gravity: Gravity | list[Gravity] | None = Field(None, description="weight that acts along the coordinate")
    fixed: bool = Field(False, description="the body is the frame")
    radius: float | None = Field(None, gt=0, description="at which tape, belt or rope runs on the body, m")
    reel: Reel | None = Field(None, description="the body winds tape: its radius and inertia are those at the start")

    @property
    def turns(self) -> bool:
        """Whether the coordinate is an angle."""
        return self.mass is None

    @property
    def weights(self) -> tuple[Gravity, ...]:
        """Every entry of `gravity`."""
        given = self.gravity
        return () if given is None else tuple(given) if isinstance(given, list) else (given,)

    @model_validator(mode="after")
    def _one(self) -> "Body":
        if self.fixed:
            return self
        if (self.inertia is None) == (self.mass is None):
            raise ValueError("give inertia (a body that turns) or mass (a body that slides)")
        for i, weight in enumerate(self.weights):
            at = f"gravity.{i}" if isinstance(self.gravity, list) else "gravity"
            if weight.incline is None and not self.turns:
                raise ValueError(f"{at}: this body slides; give incline, the slope of its way")
            if weight.incline is not None and self.turns:
                raise ValueError(f"{at}: this body turns; give mass and arm")
        if (self.radius is not None or self.reel is not None) and not self.turns:
            raise ValueError(f"{'reel' if self.radius is None else 'radius'}: this body slides; give inertia, it turns")
        if self.reel is not None and self.radius is None:
            raise ValueError("radius is missing; a reel needs that with which it starts (m)")
        return self


class _Joint(Settings):
    """A spring and damper between two bodies, or a rigid connection; `ratio` is in units of `to` for a unit of
    `from`."""

    to: str = Field(description="body at its other end, or frame")
    ratio: float = Field(1.0, description="what `to` moves for one unit of `from`: 12.7 mm/rad for a pulley")
    stiffness: float | None = Field(None, ge=0, description="in units of `to`; rigid where absent, 0 for a damper")
    damping: float = Field(0.0, ge=0, description="in units of `to`")
    span: Literal["open", "crossed"] | None = Field(
        None,
        description="tape, belt or rope between the radii of the two bodies, which turn the same way (open) or against "
        "each other (crossed); stiffness in N/m, no ratio",
    )
    contact: bool = Field(
        False, description="passes on its force by friction, as a friction wheel or a capstan on a strip; it may slip"
    )

    @model_validator(mode="after")
    def _rigid(self) -> "_Joint":
        if self.stiffness is None and self.damping:
            raise ValueError("damping: a rigid joint has none; give stiffness as well")
        if self.ratio == 0.0:
            raise ValueError("ratio: 0 connects nothing; give what `to` moves for one unit of `from`")
        if self.span is not None and self.stiffness is None:
            raise ValueError("stiffness is missing; a span of tape needs it (N/m)")
        if self.span is not None and self.ratio != 1.0:
            raise ValueError("ratio: that of a span follows from the radii of its two bodies; leave it out")
        return self


Joint: Any = create_model(  # `from` is a word of Python
    "Joint", __base__=_Joint, __doc__=_Joint.__doc__, **{"from": (str, Field(description="body, or frame"))}
)  # type: ignore[call-overload]


class Drive(Settings):
    """Drive: a recorded command becomes a force on a body, or between the two ends of a joint."""

    body: str | None = Field(None, description="body that is driven")
    joint: str | None = Field(None, description="joint whose two ends are pushed apart, instead of a body")
    column: str = Field("u", description="column of the recorded command")
    enabled: str | None = Field(
        None, description="recorded column that is 1 where the drive is on and 0 where it is off"
    )
    unit: str = Field("V", max_length=20, description="unit of the command: V, A, N, Nm, % ...")
    kind: Literal["force", "current", "voltage"] = Field("force", description="what a unit of command gives")
    gain: float = Field(1.0, description="N or Nm, A, or V for a unit of command")
    torque_constant: float | None = Field(None, gt=0, description="Nm/A or N/A; of a current or voltage drive")
    resistance: float | None = Field(None, gt=0, description="ohm, of a voltage drive")
    inductance: float | None = Field(None, gt=0, description="H, of a voltage drive")
    limit: float | None = Field(None, gt=0, description="largest command, in its unit")
    output_limit: float | None = Field(
        None, gt=0, description="most that the drive gives whatever it is asked for, in the unit of the command"
    )
    dac_bits: int | None = Field(None, ge=2, le=32, description="bits of the converter that the command passes")
    dac_range: float = Field(10.0, gt=0, description="largest command that the converter gives")
    bandwidth_hz: float | None = Field(None, gt=0, description="natural frequency of the drive, Hz")
    damping: float = Field(0.7071, gt=0, description="of the drive's second-order low pass")
    zero: float | None = Field(None, ge=0, description="time constant of a zero of the low pass, s")

    @property
    def step(self) -> float:
        """One step of the converter in units of the command; 0 for none."""
        return 0.0 if self.dac_bits is None else 2.0 * self.dac_range / 2**self.dac_bits

    @model_validator(mode="after")
    def _kind(self) -> "Drive":
        if (self.body is None) == (self.joint is None):
            raise ValueError("give body or joint, what the drive acts on")
        if self.gain == 0.0:
            raise ValueError("gain: 0 drives nothing; give what one unit of command makes")
        if self.kind != "force" and self.torque_constant is None:
            raise ValueError(f"torque_constant is missing; a {self.kind} drive needs it (Nm/A, or N/A)")
        if self.kind == "voltage" and self.resistance is None:
            raise ValueError("resistance is missing; a voltage drive needs it (ohm)")
        if self.kind == "voltage" and self.enabled is not None:
            raise ValueError("enabled: a voltage drive that is off makes no current; give its measured current instead")
        if self.zero and (self.bandwidth_hz is None or self.kind == "voltage"):
            raise ValueError("zero: it is that of the low pass of a force or current drive; give bandwidth_hz as well")
        return self


class Sensor(Settings):
    """What a recorded column shows of a body, a joint or a drive."""

    body: str | None = Field(None, description="body that is looked at")
    joint: str | None = Field(None, description="joint: its elongation, or the force in it")
    drive: str | None = Field(None, description="drive: its current")
    through: str | None = Field(
        None,
        description="span between the body and a mark on the tape that the sensor sees; its length is in the reading",
    )
    measures: Literal["position", "speed", "acceleration", "force", "current"] = "position"
    column: str = Field(description="column of the recording")
    counts_per_unit: float | None = Field(None, description="counts for one rad or m (or unit of what is measured)")
    resolution: float | None = Field(None, ge=0, description="step of the column's numbers")
    per_unit: float = Field(1.0, description="column units for one SI unit")
    noise: float | None = Field(None, ge=0, description="standard deviation, column units")
    direction: bool = Field(True, description="false: a counter of edges that counts up whichever way it turns")

    @property
    def scale(self) -> float:
        """Column units for one SI unit."""
        return self.counts_per_unit if self.counts_per_unit is not None else self.per_unit

    @property
    def grain(self) -> float:
        """Step of the column in its own units; 0 where it is unknown."""
        return 1.0 if self.counts_per_unit is not None else self.resolution or 0.0

    @model_validator(mode="after")
    def _place(self) -> "Sensor":
        if sum(x is not None for x in (self.body, self.joint, self.drive)) != 1:
            raise ValueError("give one of body, joint, drive: what the sensor looks at")
        where = "body" if self.body is not None else "joint" if self.joint is not None else "drive"
        check_place("", where, self.measures)
        if self.through is not None and (where != "body" or self.measures != "position"):
            raise ValueError("through: a length of tape is in the position of a body; give body and measures: position")
        if self.scale == 0.0:
            raise ValueError("counts_per_unit or per_unit: 0 shows nothing; give column units for one SI unit")
        if not self.direction and (self.measures != "position" or self.counts_per_unit is None):
            raise ValueError("direction: false is for a counter of edges; give measures: position and counts_per_unit")
        return self


class Input(Settings):
    """A recorded column that acts on a body besides the drives: a force, or a prescribed position."""

    body: str
    column: str
    measures: Literal["force", "position"] = "force"
    per_unit: float = Field(1.0, description="column units for one N or Nm, or for one rad or m")


class Description(Settings):
    """Bodies, joints, drives and sensors of a machine."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    bodies: dict[str, Body] = Field(min_length=1)
    joints: dict[str, Joint] = Field(default={})
    drives: dict[str, Drive] = Field(default={})
    sensors: dict[str, Sensor] = Field(min_length=1)
    mechanics: MechanicsSettings | None = Field(
        default=None, description="file with M(q) and h(q, v), where bodies move each other by more than joints"
    )
    symbols: dict[str, list[str]] = Field(
        default={}, description="symbol of the literature: dotted paths of the numbers that it stands for"
    )

    @model_validator(mode="before")
    @classmethod
    def _units(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        data = in_si(data)
        if data.get("mechanics") is not None:
            data["mechanics"] = coupling.resolved(data["mechanics"])
        return data

    @model_validator(mode="after")
    def _sound(self) -> "Description":
        from rtctl.plants.graph.checks import check

        check(self)
        coupling.check(self)
        return self

    def turns(self, body: str) -> bool:
        """Whether a body, or the frame, has an angle."""
        return body not in self.bodies or self.bodies[body].turns

    def is_frame(self, body: str) -> bool:
        """Whether a name is the frame."""
        return body == FRAME or (body in self.bodies and self.bodies[body].fixed)

    def paths(self) -> Iterator[tuple[str, float]]:
        """Every number of the description except None: dotted path and SI value."""
        for group in ("bodies", "joints", "drives", "sensors"):
            for name, element in getattr(self, group).items():
                yield from _numbers(f"{group}.{name}", element)
        if self.mechanics is not None:
            yield from ((f"mechanics.parameters.{key}", value) for key, value in self.mechanics.parameters.items())


def _numbers(path: str, element: Any) -> Iterator[tuple[str, float]]:
    for key in type(element).model_fields:
        value = getattr(element, key)
        if isinstance(value, Settings):
            yield from _numbers(f"{path}.{key}", value)
        elif isinstance(value, list):
            for i, item in enumerate(value):
                yield from _numbers(f"{path}.{key}.{i}", item)
        elif isinstance(value, float):
            yield f"{path}.{key}", value
