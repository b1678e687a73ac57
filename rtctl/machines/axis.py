"""One axis: a drive that takes volts, an encoder, and a cascade of position and speed. The plainest bench.

reference -> shaper -> error -> PD or PI with velocity feedback -> limit
"""

from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from rtctl.drivers import at_mio_16de, daq_stc, linear_scale
from rtctl.drivers.at_mio_16de import AnalogOutputSettings
from rtctl.drivers.linear_scale import LinearScaleSettings
from rtctl.idiom import Settings, quantity, state, tick
from rtctl.laws import bumpless, limit, reference, shaper, velocity
from rtctl.laws.bumpless import BumplessSettings
from rtctl.laws.excitation import ExcitationSettings, NoneSettings
from rtctl.laws.limit import LimitSettings
from rtctl.laws.reference import MetreReferenceSettings
from rtctl.laws.shaper import ShaperSettings
from rtctl.laws.velocity import VelocitySettings
from rtctl.machines.base import (
    COMMON_COLUMNS,
    STATE_LINES,
    TRACE_LINES,
    Block,
    Column,
    Diagram,
    MachineSettings,
    PlantDiagram,
    Signals,
    physics_lines,
)
from rtctl.machines.ldu import PositionSettings, play, prepare
from rtctl.machines.physics import PhysicsTerm, check_nodes
from rtctl.own import law as own_law
from rtctl.plants import axis as plant_axis
from rtctl.plants.fmu import FmuSettings
from rtctl.tick import safety

__all__ = ["play", "prepare"]  # called by the generated tick as machine.play and machine.prepare

UNIT = "m"
SETTLE_FLOOR = 0.0  # m, least settling band; 0: two percent of the step
PLANT_RATE = 1000.0  # Hz, of the free-running emulator


class AxisLawSettings(Settings):
    """The law, block by block in the order of the tick."""

    shaper: ShaperSettings = ShaperSettings()
    position: PositionSettings
    limit: LimitSettings = LimitSettings()
    bumpless: BumplessSettings = BumplessSettings()
    velocity: VelocitySettings = VelocitySettings()


class AxisPlantSettings(plant_axis.AxisSettings):
    """The emulated axis."""

    rate: float | None = quantity(None, unit="Hz", gt=0, help="rate of the emulator in real mode; the loop's if absent")
    substep: float = quantity(5e-4, unit="s", gt=0, le=1e-2, help="longest integration step")
    physics: list[PhysicsTerm] = Field(default=[], description="terms of physics beyond the equations")
    fmu: FmuSettings | None = Field(default=None, description="an FMU in the equations' place, in lockstep")

    @model_validator(mode="after")
    def _nodes(self) -> "AxisPlantSettings":
        check_nodes(self.physics, "axis")
        return self


class AxisConfig(MachineSettings):
    """One axis: a drive that takes volts, an encoder, a cascade of position and speed."""

    machine: Literal["axis"] = "axis"
    output: AnalogOutputSettings = AnalogOutputSettings(channel=0)
    encoder: LinearScaleSettings = LinearScaleSettings(pitch=1e-6)
    radius: float = quantity(1.0, unit="m", gt=0, help="metres per radian, for reports in rad")
    amp_per_volt: float = quantity(
        0.5, unit="A/V", safer="larger", gt=0, help="gain of the drive, for the current limit"
    )
    law: AxisLawSettings
    reference: MetreReferenceSettings = MetreReferenceSettings()
    excitation: ExcitationSettings = NoneSettings()
    plant: AxisPlantSettings = AxisPlantSettings()


def signals(config: Any) -> Signals:
    """Columns by which a run is judged."""
    return Signals("x", "position_error", ("u",), "truth_x")


def unit(config: Any) -> str:
    """Unit of reference and position."""
    return UNIT


def metres_per_unit(config: AxisConfig) -> float:
    """Metres in one unit of the reference."""
    return 1.0


def radius(config: AxisConfig) -> float:
    """Radius that turns metres into radians."""
    return config.radius


class AxisParams(NamedTuple):
    settle: int
    amp_per_volt: float


AXIS_STATE = state(k_run=int, gains=int, play=int, u_fb=float)


@tick
def switch_on(p, s, x):
    """Reset all laws to the carriage's position `x` in m, in the tick in which outputs come on."""
    reference.hold(0, s.reference, x)
    shaper.reset(p.shaper, s.shaper, x)
    velocity.reset(p.velocity, s.velocity)
    bumpless.reset(p.bumpless, s.bumpless)
    limit.reset(p.limit, s.limit, 0.0)
    s.machine.u_fb = 0.0


COLUMNS = (
    *COMMON_COLUMNS,
    Column("target", "m", "reference before shaping"),
    Column("ref", "m", "position reference"),
    Column("w", "V", "excitation added to the controller's output"),
    Column("u", "V", "written, after limit and 12-bit rounding"),
    Column("x_counts", "counts", "encoder"),
    Column("x", "m", "measured position"),
    Column("position_error", "m", "ref - x"),
    Column("speed", "m/s", "filtered difference of the position"),
    Column("u_c", "V", "command before the limit"),
)
USES = (
    "rtctl.drivers.at_mio_16de",
    "rtctl.drivers.daq_stc",
    "rtctl.drivers.linear_scale",
    "rtctl.laws.bumpless",
    "rtctl.laws.excitation",
    "rtctl.laws.limit",
    "rtctl.laws.reference",
    "rtctl.laws.shaper",
    "rtctl.laws.velocity",
    "rtctl.tick.safety",
)
LAW_SIGNALS = {
    "e": "y.position_error", "x": "y.x", "v": "y.speed", "ref": "y.ref", "v_ref": "s.shaper.speed",
    "a_ref": "s.shaper.acceleration", "u": "y.u",
}  # fmt: skip
TRACKED = {"u_wanted": "y.u_c", "u_written": "u"}
TRUTH = (
    Column("truth_x", "m", "position in the emulator"),
    Column("truth_speed", "m/s", "speed in the emulator"),
)


def diagram(config: AxisConfig, dt: float) -> Diagram:
    """Blocks and lines of the loop's tick."""
    law = config.law
    position = own_law.lines(law.position, "u_fb", LAW_SIGNALS, TRACKED)
    blocks = (
        Block("machine", AxisParams(round(0.05 / dt), config.amp_per_volt), AXIS_STATE),
        Block("safety", safety.build(config.safety, dt), safety.SAFETY_STATE),
        Block("encoder", linear_scale.build(config.encoder, dt), daq_stc.READER_STATE),
        Block("reference", None, reference.REFERENCE_STATE),
        Block("shaper", shaper.build(law.shaper, dt), shaper.SHAPER_STATE),
        Block("velocity", velocity.build(law.velocity, dt), velocity.VELOCITY_STATE),
        Block("position", position.parts.build(law.position, dt), position.parts.state),
        Block("bumpless", bumpless.build(law.bumpless, dt), bumpless.BUMPLESS_STATE),
        Block("limit", limit.build(law.limit, dt), limit.LIMIT_STATE),
        Block("output", at_mio_16de.build_output(config.output, dt), None),
    )
    stages = (
        (
            "read",
            (
                "y.watchdog = safety.board_watchdog(s.safety, rx, tx)",
                "y.x_counts = daq_stc.counter_position(s.encoder, rx.counter_codes[0])",
                "y.x = linear_scale.metres(p.encoder, y.x_counts)",
            ),
        ),
        (
            "state",
            (
                *STATE_LINES,
                "if s.safety.on != 0:",
                "    machine.switch_on(p, s, y.x)",
                *(f"    {line}" for line in position.reset),
                "machine.prepare(p, s, c, k)",
            ),
        ),
        (
            "reference",
            (
                "machine.play(t, s, c, k)",
                "y.target = reference.step(t.reference, s.reference, c.setpoint, k)",
                "y.ref = shaper.step(p.shaper, s.shaper, y.target)",
                "y.w = excitation.step(t.excitation, k - s.machine.k_run) if s.safety.state == safety.RUNNING else 0.0",
            ),
        ),
        (
            "law",
            (
                "y.position_error = y.ref - y.x",
                "y.speed = velocity.step(p.velocity, s.velocity, y.x, passed)",
                *position.step,
                "changed = c.gains != s.machine.gains",
                "s.machine.u_fb = bumpless.step(p.bumpless, s.bumpless, u_fb, changed, s.machine.u_fb)",
                "s.machine.gains = c.gains",
                "y.u_c = s.machine.u_fb + y.w",
                "u = limit.step(p.limit, s.limit, y.u_c)",
                *position.track,
            ),
        ),
        (
            "safety",
            (
                "amperes = abs(u) * p.machine.amp_per_volt",
                "safety.check_motion(p.safety, s.safety, y.position_error, y.x_counts, u, amperes, k)",
                "safety.check_number(s.safety, y.u_c, k)",
                "safety.fade(p.safety, s.safety)",
            ),
        ),
        (
            "write",
            (
                "tx.ao_codes[0] = at_mio_16de.volts_to_codes(p.output, safety.gate(p.safety, s.safety, u, 0))",
                "y.u = at_mio_16de.codes_to_volts(p.output, tx.ao_codes[0])",
                *TRACE_LINES,
            ),
        ),
    )
    return Diagram((*USES, position.uses), blocks, COLUMNS, stages)


def substeps(config: AxisConfig, period: float) -> int:
    """Integration steps of the emulator in `period` s."""
    return max(1, int(np.ceil(period / config.plant.substep - 1e-9)))


def plant_diagram(config: AxisConfig, period: float, seed: int) -> PlantDiagram:
    """Blocks and lines of the emulated machine, advanced by `period` s a call."""
    h = period / substeps(config, period)
    terms = physics_lines(config.plant.physics, "axis", h)
    blocks = (
        Block("plant", plant_axis.build(config.plant, h), plant_axis.AXIS_STATE),
        Block("output", at_mio_16de.build_output(config.output, h), at_mio_16de.ANALOG_OUTPUT_STATE),
        Block("encoder", linear_scale.build(config.encoder, h), linear_scale.LINEAR_SCALE_STATE),
        Block("counter0", None, daq_stc.COUNTER_STATE),
        *terms.blocks,
    )
    advance = (
        (
            "drive",
            (
                "s.plant.m.volts[0] = at_mio_16de.output_step(p.output, s.output, tx.ao_codes[0], p.plant.h)",
                *terms.command,
                "s.plant.m.u[0] = s.plant.m.volts[0]",
            ),
        ),
        ("physics", ("linear.midpoint(s.plant.m)", *terms.force, "linear.advance(s.plant.m)")),
        (
            "encoder",
            (
                "plant.read(p.plant.graph, s.plant.m)",
                *terms.reading,
                "pulses = linear_scale.step(p.encoder, s.encoder, s.plant.m.y[0])",
                "daq_stc.counter_step(s.counter0, abs(pulses), pulses > 0)",
            ),
        ),
    )
    sample = (
        ("scan", ("rx.counter_codes[0] = daq_stc.counter_step(s.counter0, 0, 1)",)),
        ("truth", ("rx.truth[0] = s.plant.m.x[0]", "rx.truth[1] = s.plant.m.x[1]")),
    )
    return PlantDiagram(
        uses=(
            "rtctl.drivers.at_mio_16de",
            "rtctl.drivers.daq_stc",
            "rtctl.drivers.linear_scale",
            "rtctl.plants.graph.plant",
            "rtctl.plants.linear",
            *terms.uses,
        ),
        blocks=blocks,
        truth=TRUTH,
        start=("plant.start(p.plant.graph, s.plant)",),
        advance=advance,
        sample=sample,
    )
