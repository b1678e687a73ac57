"""The Linear Drive Unit at 10 kHz: a board, an amplifier with a direction bit, a rotary encoder, a linear scale.

Block diagram of the tick, thesis figures 12.7 and 12.10:

    reference -> shaper -> error -> law (PI with velocity feedback, PD, or any sections) -> + friction -> limit
"""

from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, model_validator

from rtctl.drivers import at_mio_16de, daq_stc, ldu_amplifier, linear_scale, ls7084
from rtctl.drivers.at_mio_16de import AnalogOutputSettings
from rtctl.drivers.ldu_amplifier import LduAmplifierSettings
from rtctl.drivers.linear_scale import LinearScaleSettings
from rtctl.drivers.ls7084 import Ls7084Settings
from rtctl.idiom import Settings, quantity, state, tick
from rtctl.laws import (
    bumpless,
    error_table,
    friction_feedforward,
    limit,
    reference,
    shaper,
    velocity,
)
from rtctl.laws.bumpless import BumplessSettings
from rtctl.laws.error_table import ErrorTableSettings
from rtctl.laws.excitation import ExcitationSettings, NoneSettings
from rtctl.laws.limit import LimitSettings
from rtctl.laws.pd import PdMetreSettings
from rtctl.laws.pi_velocity import PiVelocitySettings
from rtctl.laws.reference import MetreReferenceSettings
from rtctl.laws.sections import SectionsSettings
from rtctl.laws.shaper import ShaperSettings
from rtctl.laws.velocity import VelocitySettings
from rtctl.machines import compensation
from rtctl.machines.base import (
    COMMON_COLUMNS,
    STATE_LINES,
    TRACE_LINES,
    Block,
    Column,
    Diagram,
    MachineSettings,
    Signals,
)
from rtctl.machines.ldu_motion import mechanics
from rtctl.machines.ldu_plant import plant_diagram, substeps
from rtctl.machines.physics import PhysicsTerm, check_nodes
from rtctl.own import law as own_law
from rtctl.plants import ldu as plant_ldu
from rtctl.plants.fmu import FmuSettings
from rtctl.tick import safety

__all__ = ["LduConfig", "diagram", "mechanics", "plant_diagram", "substeps"]

UNIT = "m"
SETTLE_FLOOR = 4e-6  # m, least settling band: 4 um are "more than allowed" (11.1)
PLANT_RATE = 10_000.0  # Hz, of the free-running emulator


class LduBoardSettings(Settings):
    """AT-MIO-16DE-10: one output to the amplifier, a digital line for its direction, both counters."""

    output: AnalogOutputSettings = AnalogOutputSettings(channel=0)
    direction_line: int = Field(default=0, ge=0, le=5, description="digital line of the direction bit; 6 and 7 count")


class LduSensorSettings(Settings):
    """Encoder on the motor shaft, linear scale on the carriage, and which of them the loop closes on."""

    encoder: Ls7084Settings = Ls7084Settings(lines=5000)
    scale: LinearScaleSettings = LinearScaleSettings()
    feedback: Literal["encoder", "scale"] = Field(default="encoder", description="what the loop closes on (11.3)")
    R_c: float = quantity(3.0e-3, unit="m", gt=0, help="capstan radius that turns encoder angle into position (11.2)")
    correction: ErrorTableSettings | None = Field(
        default=None, description="error table for the position by the encoder (11.12)"
    )


class PiLawSettings(PiVelocitySettings):
    """The present controller: PI on position, velocity feedback (figure 12.7)."""

    kind: Literal["pi_velocity"] = "pi_velocity"


class PdLawSettings(PdMetreSettings):
    """PD position law with a filtered derivative."""

    kind: Literal["pd"] = "pd"


class SectionsLawSettings(SectionsSettings):
    """Lead-lag, notches, low-pass: up to four sections (figure 12.9)."""

    kind: Literal["sections"] = "sections"


PositionSettings = Annotated[PiLawSettings | PdLawSettings | SectionsLawSettings, Field(discriminator="kind")]


class FrictionSettings(Settings):
    """Friction compensation in the direction of the reference's motion (12.6)."""

    F_c: float = quantity(0.0, unit="N", ge=0, help="dry friction of the carriage to compensate (12.6)")
    newton_per_volt: float = quantity(14.0, unit="N/V", gt=0, help="force at the carriage per volt: N K_m 0.1 / R_c")


class ComputedTorqueSettings(Settings):
    """Acceleration feedforward (12.10)."""

    volts: float = quantity(
        0.0,
        unit="V*s^2/m",
        ge=0,
        help="command per acceleration of the shaped reference (12.10); the shaper has to be on",
    )


class ComputedTorqueParams(NamedTuple):
    volts: float


MetreCompensationSettings: Any = compensation.in_units({"rad": "m"})


class LduLawSettings(Settings):
    """The law, block by block in the order of the tick."""

    shaper: ShaperSettings = ShaperSettings()
    position: PositionSettings
    friction: FrictionSettings = FrictionSettings()
    inertia: ComputedTorqueSettings = ComputedTorqueSettings()
    limit: LimitSettings = LimitSettings(high=3.0)
    bumpless: BumplessSettings = BumplessSettings()
    velocity: VelocitySettings = VelocitySettings(filter=200.0)
    compensation: MetreCompensationSettings = MetreCompensationSettings()


class LduPlantSettings(plant_ldu.LduSettings):
    """The emulated drive."""

    rate: float | None = quantity(None, unit="Hz", gt=0, help="rate of the emulator in real mode; the loop's if absent")
    substep: float = quantity(5e-5, unit="s", gt=0, le=2e-4, help="longest integration step")
    amplifier: LduAmplifierSettings = LduAmplifierSettings(kind="linear")
    bandwidth: float = quantity(2000.0, unit="Hz", gt=0, help="of the amplifier's current loop (12.2)")
    damping: float = quantity(0.7071, unit="", gt=0, help="of the amplifier's current loop")
    physics: list[PhysicsTerm] = Field(default=[], description="terms of physics beyond the equations")
    fmu: FmuSettings | None = Field(default=None, description="an FMU in the equations' place, in lockstep")

    @model_validator(mode="after")
    def _nodes(self) -> "LduPlantSettings":
        check_nodes(self.physics, "ldu")
        return self


class LduConfig(MachineSettings):
    """The Linear Drive Unit at 10 kHz."""

    machine: Literal["ldu"] = "ldu"
    board: LduBoardSettings = LduBoardSettings()
    sensors: LduSensorSettings = LduSensorSettings()
    amplifier: LduAmplifierSettings = LduAmplifierSettings(kind="linear")
    law: LduLawSettings
    reference: MetreReferenceSettings = MetreReferenceSettings()
    excitation: ExcitationSettings = NoneSettings()
    plant: LduPlantSettings = LduPlantSettings()


def signals(config: Any) -> Signals:
    """Columns by which a run is judged."""
    return Signals("position", "position_error", ("u",), "truth_x")


def unit(config: Any) -> str:
    """Unit of reference and position."""
    return UNIT


def metres_per_unit(config: LduConfig) -> float:
    """Metres in one unit of the reference."""
    return 1.0


def radius(config: LduConfig) -> float:
    """Radius that turns metres into radians of the capstan."""
    return config.sensors.R_c


class LduParams(NamedTuple):
    R_c: float
    line: int  # bit of the direction line
    settle: int
    amp_per_volt: float


LDU_STATE = state(k_run=int, gains=int, play=int, u_fb=float)


@tick
def switch_on(p, s, x):
    """Reset all laws to the carriage's position `x` in m, in the tick in which outputs come on."""
    reference.hold(0, s.reference, x)
    shaper.reset(p.shaper, s.shaper, x)
    velocity.reset(p.velocity, s.velocity)
    friction_feedforward.reset(p.friction, s.friction)
    bumpless.reset(p.bumpless, s.bumpless)
    limit.reset(p.limit, s.limit, 0.0)
    s.machine.u_fb = 0.0


COLUMNS = (
    *COMMON_COLUMNS,
    Column("target", "m", "reference before shaping"),
    Column("ref", "m", "position reference"),
    Column("w", "V", "excitation added to the controller's output"),
    Column("u", "V", "written, signed by the direction bit, after limit and 12-bit rounding"),
    Column("encoder_counts", "counts", "rotary encoder, quadrature x4"),
    Column("scale_counts", "counts", "linear scale on the carriage"),
    Column("position", "m", "R_c times the encoder angle, or the scale, as `feedback` says"),
    Column("scale", "m", "position by the linear scale"),
    Column("position_error", "m", "ref - position"),
    Column("speed", "m/s", "filtered difference of the position"),
    Column("u_c", "V", "command before the limit"),
)

LAW_SIGNALS = {
    "e": "y.position_error", "x": "y.position", "v": "y.speed", "ref": "y.ref", "v_ref": "s.shaper.speed",
    "a_ref": "s.shaper.acceleration", "u": "y.u",
}  # fmt: skip


OWN = "p.friction.volts * s.friction.direction"  # V of the friction compensation


def stages(config: LduConfig, more: compensation.Lines = compensation.NONE) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Lines of the tick for the law, the feedback and the compensation of this config."""
    asked = "asked" if more.inverse else "u_c"
    law = own_law.lines(config.law.position, "u_fb", LAW_SIGNALS, {"u_wanted": asked, "u_written": "u"})
    encoder = position = "p.machine.R_c * ls7084.radians(p.encoder, y.encoder_counts)"
    if config.sensors.feedback == "scale":
        position = "y.scale"
    elif config.sensors.correction is not None:
        position = f"error_table.step(p.correction, {position})"
    return (
        (
            "read",
            (
                "y.watchdog = safety.board_watchdog(s.safety, rx, tx)",
                "y.encoder_counts = daq_stc.counter_position(s.encoder, rx.counter_codes[0])",
                "y.scale_counts = daq_stc.counter_position(s.scale, rx.counter_codes[1])",
                "y.scale = linear_scale.metres(p.scale, y.scale_counts)",
                f"y.position = {position}",
                *more.read,
            ),
        ),
        (
            "state",
            (
                *STATE_LINES,
                "if s.safety.on != 0:",
                "    machine.switch_on(p, s, y.position)",
                *(f"    {line}" for line in (*law.reset, *more.reset)),
                "machine.prepare(p, s, c, k)",
            ),
        ),
        (
            "reference",
            (
                "machine.play(t, s, c, k)",
                "y.target = reference.step(t.reference, s.reference, c.setpoint, k)",
                "y.ref = shaper.step(p.shaper, s.shaper, y.target)",
                *more.reference,
                "y.w = excitation.step(t.excitation, k - s.machine.k_run) if s.safety.state == safety.RUNNING else 0.0",
            ),
        ),
        (
            "law",
            (
                f"y.position_error = y.ref{more.shift} - {more.closed or 'y.position'}",
                "y.speed = velocity.step(p.velocity, s.velocity, y.position, passed)",
                *law.step,
                *more.filter,
                "changed = c.gains != s.machine.gains",
                "s.machine.u_fb = bumpless.step(p.bumpless, s.bumpless, u_fb, changed, s.machine.u_fb)",
                "s.machine.gains = c.gains",
                "u_ff = friction_feedforward.step(p.friction, s.friction, y.ref)",
                "u_ff += p.inertia.volts * s.shaper.acceleration",
                *more.law,
                f"u_c = s.machine.u_fb + u_ff + y.w{more.extra}",
                *more.inverse,
                f"u = limit.step(p.limit, s.limit, {asked})",
                *law.track,
                *more.track,
                "y.u_c = u_c",
            ),
        ),
        (
            "safety",
            (
                "amperes = abs(u) * p.machine.amp_per_volt",
                "safety.check_motion(p.safety, s.safety, y.position_error, y.encoder_counts, u, amperes, k)",
                "safety.check_number(s.safety, u_c, k)",
                f"safety.check_sensors(p.safety, s.safety, {encoder} - y.scale, k)",
                "safety.fade(p.safety, s.safety)",
            ),
        ),
        (
            "write",
            (
                "u = safety.gate(p.safety, s.safety, u, 0)",
                "forward = ldu_amplifier.direction(p.amplifier, u)",
                "tx.ao_codes[0] = at_mio_16de.volts_to_codes(p.output, ldu_amplifier.encode(p.amplifier, u))",
                "tx.dio_lines = forward << p.machine.line",
                "y.u = (1.0 if forward != 0 else -1.0) * at_mio_16de.codes_to_volts(p.output, tx.ao_codes[0])",
                *TRACE_LINES,
            ),
        ),
    )


@tick
def prepare(p, s, c, k):
    """Change from armed to running after `p.machine.settle` ticks."""
    if s.safety.state == safety.ARMED and s.safety.armed_for > p.machine.settle:
        s.safety.state = safety.RUNNING
        s.machine.k_run = k


@tick
def play(t, s, c, k):
    """Start the reference table on request while the machine runs; a request while it is off is dropped."""
    if s.safety.state == safety.IDLE or s.safety.state == safety.TRIPPED:
        s.machine.play = c.play
    elif s.safety.state == safety.RUNNING and c.play != s.machine.play:
        reference.start(t.reference, s.reference, k)
        s.machine.play = c.play


def diagram(config: LduConfig, dt: float) -> Diagram:
    """Blocks and lines of the loop's tick. Raises ValueError with the key at fault in the sentence."""
    law = config.law
    asked = "u_c" if law.compensation.inverse is None else "asked"
    names = compensation.Signals("u_fb", "y.position_error", "y.position", "y.speed", "u_c", asked, "u", OWN, {0: 1.0})
    more = compensation.lines(law.compensation, names, config.kind, lambda: mechanics(config, dt), dt)
    position = own_law.law_of(law.position)
    output = at_mio_16de.build_output(config.board.output, dt)
    volts = law.friction.F_c / law.friction.newton_per_volt
    table = config.sensors.correction if config.sensors.feedback == "encoder" else None
    corrections = [] if table is None else [Block("correction", error_table.build(table, dt), None)]
    blocks = (
        Block("machine", LduParams(config.sensors.R_c, config.board.direction_line, round(0.05 / dt), 0.1), LDU_STATE),
        Block("safety", safety.build(config.safety, dt), safety.SAFETY_STATE),
        Block("encoder", ls7084.build(config.sensors.encoder, dt), daq_stc.READER_STATE),
        Block("scale", linear_scale.build(config.sensors.scale, dt), daq_stc.READER_STATE),
        *corrections,
        Block("reference", None, reference.REFERENCE_STATE),
        Block("shaper", shaper.build(law.shaper, dt), shaper.SHAPER_STATE),
        Block("velocity", velocity.build(law.velocity, dt), velocity.VELOCITY_STATE),
        Block("position", position.build(law.position, dt), position.state),
        Block("bumpless", bumpless.build(law.bumpless, dt), bumpless.BUMPLESS_STATE),
        Block(
            "friction",
            friction_feedforward.FrictionFeedforwardParams(volts),
            friction_feedforward.FRICTION_FEEDFORWARD_STATE,
        ),
        Block("inertia", ComputedTorqueParams(law.inertia.volts), None),
        Block("limit", limit.build(law.limit, dt), limit.LIMIT_STATE),
        Block("amplifier", ldu_amplifier.build(config.amplifier, dt, output.volts_per_code), None),
        Block("output", output, None),
        *more.blocks,
    )
    uses = (*USES, *more.uses, position.module.__name__, *(["rtctl.laws.error_table"] if corrections else []))
    return Diagram(uses, blocks, COLUMNS, stages(config, more))


USES = (
    "rtctl.drivers.at_mio_16de",
    "rtctl.drivers.daq_stc",
    "rtctl.drivers.ldu_amplifier",
    "rtctl.drivers.linear_scale",
    "rtctl.drivers.ls7084",
    "rtctl.laws.bumpless",
    "rtctl.laws.excitation",
    "rtctl.laws.friction_feedforward",
    "rtctl.laws.limit",
    "rtctl.laws.reference",
    "rtctl.laws.shaper",
    "rtctl.laws.velocity",
    "rtctl.tick.safety",
)
