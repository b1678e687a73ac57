"""Any described machine: one drive commanded from one sensor, with the law of an axis in the machine's own units.

reference -> shaper -> error -> PD, PI with velocity feedback, or sections -> limit
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.drivers import daq_stc
from rtctl.idiom import state, tick
from rtctl.laws import bumpless, limit, reference, shaper, velocity
from rtctl.machines import compensation
from rtctl.machines.base import STATE_LINES, TRACE_LINES, Block, Diagram, PlantDiagram
from rtctl.machines.described_motion import mechanics
from rtctl.machines.described_parts import columns, metres_per_unit, parts_of, radius, shares_of, signals, unit
from rtctl.machines.described_plant import converter, is_counter, readout_of, wires
from rtctl.machines.described_plant import plant_diagram as described_plant
from rtctl.machines.described_settings import DescribedConfig, config_class
from rtctl.own import law as own_law
from rtctl.plants.linear import MOST_DRIVES
from rtctl.tick import safety

__all__ = [
    "DescribedConfig",
    "config_class",
    "diagram",
    "mechanics",
    "metres_per_unit",
    "parts_of",
    "plant_diagram",
    "radius",
    "shares_of",
    "signals",
    "unit",
]  # fmt: skip

SETTLE_FLOOR = 0.0  # least settling band; 0: two percent of the step
PLANT_RATE = 1000.0  # Hz, of the free-running emulator


class DescribedParams(NamedTuple):
    settle: int  # ticks
    per_column: float  # rad or m (or per s) of the feedback for one unit of its column
    ampere: float  # A for one unit of command, 0 if unknown
    shares: np.ndarray  # (MOST_DRIVES,) of the command, with the sign that moves the feedback forwards


DESCRIBED_STATE = state(k_run=int, gains=int, play=int, u_fb=float)


@tick
def settle(p, s, guard, k):
    """Change from armed to running after `p.settle` ticks."""
    if guard.state == safety.ARMED and guard.armed_for > p.settle:
        guard.state = safety.RUNNING
        s.k_run = k


@tick
def play(t, s, guard, c, made, k):
    """Start the reference table on request while the machine runs; a request while it is off is dropped."""
    if guard.state == safety.IDLE or guard.state == safety.TRIPPED:
        s.play = c.play
    elif guard.state == safety.RUNNING and c.play != s.play:
        reference.start(t, made, k)
        s.play = c.play


def _params(config: Any, dt: float) -> DescribedParams:
    parts = parts_of(config)
    drive, shares = parts.machine.drives[parts.drive], np.zeros(MOST_DRIVES)
    shares[: len(parts.machine.drives)] = shares_of(config)
    ampere = {"current": abs(drive.gain), "voltage": abs(drive.gain) / (drive.resistance or 1.0)}.get(drive.kind, 0.0)
    scale = parts.machine.sensors[parts.feedback].scale
    return DescribedParams(round(0.05 / dt), 1.0 / scale, ampere, shares)


def diagram(config: Any, dt: float) -> Diagram:
    """Blocks and lines of the loop's tick."""
    law, parts = config.law, parts_of(config)
    machine, number = parts.machine, parts.number
    column, wire = machine.drives[parts.drive].column, wires(machine)
    read = machine.sensors[parts.feedback].column
    rate = "rate" if parts.is_speed else "y.speed"
    seen = list(machine.sensors).index(parts.feedback)
    still = f"y.{read}" if is_counter(machine.sensors[parts.feedback]) else f"readout.code(p.sensor{seen}, y.{read})"
    signals = {
        "e": "y.position_error", "x": "y.feedback", "v": rate, "ref": "y.ref", "v_ref": "s.shaper.speed",
        "a_ref": "s.shaper.acceleration", "u": f"p.machine.shares[{number}] * y.{column}",
    }  # fmt: skip
    asked = "y.u_c" if law.compensation.inverse is None else "asked"
    position = own_law.lines(law.position, "u_fb", signals, {"u_wanted": asked, "u_written": "u"})
    share = {number: float(shares_of(config)[number])}
    names = compensation.Signals("u_fb", "y.position_error", "y.feedback", "y.speed", "y.u_c", asked, "u", "0.0", share)
    more = compensation.lines(law.compensation, names, config.kind, lambda: mechanics(config, dt), dt)
    blocks = (
        Block("machine", _params(config, dt), DESCRIBED_STATE),
        Block("safety", safety.build(config.safety, dt), safety.SAFETY_STATE),
        *(
            Block(f"sensor{n}", None, daq_stc.READER_STATE)
            if is_counter(sensor)
            else Block(f"sensor{n}", readout_of(sensor, 0), None)
            for n, sensor in enumerate(machine.sensors.values())
        ),
        Block("reference", None, reference.REFERENCE_STATE),
        Block("shaper", shaper.build(law.shaper, dt), shaper.SHAPER_STATE),
        Block("velocity", velocity.build(law.velocity, dt), velocity.VELOCITY_STATE),
        Block("position", position.parts.build(law.position, dt), position.parts.state),
        Block("bumpless", bumpless.build(law.bumpless, dt), bumpless.BUMPLESS_STATE),
        Block("limit", limit.build(law.limit, dt), limit.LIMIT_STATE),
        *(Block(f"drive{n}", converter(config, n), None) for n in range(len(machine.drives))),
        *more.blocks,
    )
    stages = (
        (
            "read",
            (
                "y.watchdog = safety.board_watchdog(s.safety, rx, tx)",
                *(
                    f"y.{sensor.column} = "
                    + (
                        f"daq_stc.counter_position(s.sensor{n}, {wire[name]})"
                        if is_counter(sensor)
                        else f"readout.value(p.sensor{n}, {wire[name]})"
                    )
                    for n, (name, sensor) in enumerate(machine.sensors.items())
                ),
                f"y.feedback = p.machine.per_column * y.{read}",
                *more.read,
            ),
        ),
        (
            "state",
            (
                *STATE_LINES,
                "if s.safety.on != 0:",
                *(f"    {line}" for line in SWITCH_ON),
                *(f"    {line}" for line in (*position.reset, *more.reset)),
                "machine.settle(p.machine, s.machine, s.safety, k)",
            ),
        ),
        (
            "reference",
            (
                "machine.play(t.reference, s.machine, s.safety, c, s.reference, k)",
                "y.target = reference.step(t.reference, s.reference, c.setpoint, k)",
                "y.ref = shaper.step(p.shaper, s.shaper, y.target)",
                *more.reference,
                "y.w = excitation.step(t.excitation, k - s.machine.k_run) if s.safety.state == safety.RUNNING else 0.0",
            ),
        ),
        (
            "law",
            (
                f"y.position_error = y.ref{more.shift} - {more.closed or 'y.feedback'}",
                f"{rate} = velocity.step(p.velocity, s.velocity, y.feedback, passed)",
                *(("y.speed = y.feedback",) if parts.is_speed else ()),
                *position.step,
                *more.filter,
                "changed = c.gains != s.machine.gains",
                "s.machine.u_fb = bumpless.step(p.bumpless, s.bumpless, u_fb, changed, s.machine.u_fb)",
                "s.machine.gains = c.gains",
                *more.law,
                f"y.u_c = s.machine.u_fb + y.w{more.extra}",
                *more.inverse,
                f"u = limit.step(p.limit, s.limit, {asked})",
                *position.track,
                *more.track,
            ),
        ),
        (
            "safety",
            (
                "amperes = abs(u) * p.machine.ampere",
                f"safety.check_motion(p.safety, s.safety, y.position_error, {still}, u, amperes, k)",
                "safety.check_number(s.safety, y.u_c, k)",
                "safety.fade(p.safety, s.safety)",
            ),
        ),
        (
            "write",
            (
                *(
                    line
                    for n, drive in enumerate(machine.drives.values())
                    for line in (
                        f"given = safety.gate(p.safety, s.safety, p.machine.shares[{n}] * u, {n})",
                        f"tx.ao_codes[{n}] = at_mio_16de.volts_to_codes(p.drive{n}, given)",
                        f"y.{drive.column} = at_mio_16de.codes_to_volts(p.drive{n}, tx.ao_codes[{n}])",
                    )
                ),
                *TRACE_LINES,
            ),
        ),
    )
    return Diagram((*USES, *more.uses, position.uses), blocks, columns(config), stages)


SWITCH_ON = (  # in the tick in which outputs come on, all laws are reset to the present position
    "reference.hold(0, s.reference, y.feedback)",
    "shaper.reset(p.shaper, s.shaper, y.feedback)",
    "velocity.reset(p.velocity, s.velocity)",
    "bumpless.reset(p.bumpless, s.bumpless)",
    "limit.reset(p.limit, s.limit, 0.0)",
    "s.machine.u_fb = 0.0",
)
USES = (
    "rtctl.drivers.at_mio_16de",
    "rtctl.drivers.daq_stc",
    "rtctl.drivers.readout",
    "rtctl.laws.bumpless",
    "rtctl.laws.excitation",
    "rtctl.laws.limit",
    "rtctl.laws.reference",
    "rtctl.laws.shaper",
    "rtctl.laws.velocity",
    "rtctl.tick.safety",
)


def substeps(config: Any, period: float) -> int:
    """Integration steps of the emulator in `period` s."""
    return max(1, int(np.ceil(period / config.plant.substep - 1e-9)))


def plant_diagram(config: Any, period: float, seed: int) -> PlantDiagram:
    """Blocks and lines of the emulated machine, advanced by `period` s a call."""
    return described_plant(config, period / substeps(config, period), seed)
