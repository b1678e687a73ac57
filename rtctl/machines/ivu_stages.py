"""Lines of the reel unit's tick by stage, with placeholders for the lines that depend on the config."""

from rtctl.machines import compensation
from rtctl.machines.base import STATE_LINES, TRACE_LINES
from rtctl.own import law as own_law

STEP, RESET = "<step of the position law>", "<reset of the position law>"  # lines that depend on the config
READ, REFERENCE, ERROR = "<compensation once read>", "<compensation along the reference>", "<error>"
COMMAND, TRACK = "<command>", "<compensation after the limits>"
LAW_SIGNALS = {
    "e": "y.capstan_error", "x": "y.capstan", "v": "y.capstan_speed", "ref": "y.ref", "v_ref": "s.shaper.speed",
    "a_ref": "s.shaper.acceleration", "u": "y.u_c", "R1": "y.R1", "R2": "y.R2",
}  # fmt: skip
WRITTEN = "min(max(y.u_c, p.limit.low), p.limit.high)"
NAMES = compensation.Signals(
    "u_pd",
    "y.capstan_error",
    "y.capstan",
    "y.capstan_speed",
    "y.u_c",
    "y.u_c",
    WRITTEN,
    "s.hand_over.u",
    {},
    "s.inertia.u1 - s.inertia.u2 * y.R1 / y.R2",
)
STAGES = (
    (
        "read",
        (
            "y.watchdog = safety.board_watchdog(s.safety, rx, tx)",
            "y.capstan_counts = daq_stc.counter_position(s.capstan, rx.counter_codes[0])",
            "y.capstan = ls7084.radians(p.capstan, y.capstan_counts)",
            READ,
            "y.reel1_counts = optical_sensor.count("
            "p.reel1, s.reel1, at_mio_16de.codes_to_input_volts(p.input1, rx.ai_codes[0]))",
            "y.reel2_counts = optical_sensor.count("
            "p.reel2, s.reel2, at_mio_16de.codes_to_input_volts(p.input2, rx.ai_codes[1]))",
        ),
    ),
    (
        "state",
        (
            *STATE_LINES,
            "if s.safety.on != 0:",
            "    machine.switch_on(p, s, y.capstan)",
            RESET,
            "if s.safety.state == safety.ARMED:",
            "    machine.prepare(p, s, y.capstan, y.reel1_counts, y.reel2_counts, k)",
        ),
    ),
    (
        "estimate",
        (
            "reel_growth.step(p.machine, s.machine, y.capstan)",
            "y.R1 = s.machine.R1",
            "y.R2 = s.machine.R2",
            "y.capstan_speed = velocity.step(p.velocity, s.velocity, y.capstan, passed)",
            "acceleration = velocity.step(p.velocity, s.acceleration, y.capstan_speed, passed)",
            "tension_estimate.step("
            "p.tension_estimate, s.tension_estimate, y.u1, y.u2, y.capstan_speed, acceleration, y.R1, y.R2)",
            "y.tension1_estimate = s.tension_estimate.T1",
            "y.tension2_estimate = s.tension_estimate.T2",
        ),
    ),
    (
        "reference",
        (
            "machine.play(t, s, c, k)",
            "y.target = reference.step(t.reference, s.reference, c.setpoint, k)",
            "y.ref = shaper.step(p.shaper, s.shaper, y.target)",
            REFERENCE,
            "speed = velocity.step(p.reference_speed, s.reference_speed, y.ref)",
            "running = s.safety.state == safety.RUNNING",
            "y.w = excitation.step(t.excitation, k - s.machine.k_run) if running else 0.0",
        ),
    ),
    (
        "law",
        (
            ERROR,
            STEP,
            "y.gain_factor = gain_schedule.step(p.gain_schedule, s.gain_schedule, y.R1, y.R2, u_pd)",
            "changed = c.gains != s.machine.gains",
            "s.machine.u_fb = bumpless.step(p.bumpless, s.bumpless, y.gain_factor * u_pd, changed, s.machine.u_fb)",
            "s.machine.gains = c.gains",
            "u_f1 = friction_feedforward.step(p.friction1, s.friction1, y.ref)",
            "u_f2 = friction_feedforward.step(p.friction2, s.friction2, y.ref)",
            "forward = s.friction1.direction > 0.0",
            "hand_over.step(p.machine, s.hand_over, u_f1, u_f2, forward, speed, y.R1, y.R2)",
            COMMAND,
            "tension.step(p.tension, s.tension, y.R1, y.R2)",
            "inertia_feedforward.step(p.inertia, s.inertia, s.shaper.acceleration, y.R1, y.R2)",
            "T1 = s.tension.V1 + s.inertia.u1 + s.hand_over.u1",
            "T2 = s.tension.V2 + s.inertia.u2 + s.hand_over.u2",
            "allocation.step(p.allocation, s.allocation, y.u_c, T1, T2)",
            "measuring = p.machine.measure != 0 and s.safety.state == safety.ARMED and s.machine.prepared == 0",
            "u1 = limit.step(p.limit, s.limit1, s.reel_radius.u1 if measuring else s.allocation.u1)",
            "u2 = limit.step(p.limit, s.limit2, s.reel_radius.u2 if measuring else s.allocation.u2)",
            TRACK,
        ),
    ),
    (
        "safety",
        (
            "amperes = max(abs(u1), abs(u2)) * p.drive.amp_per_volt",
            "safety.check_motion(p.safety, s.safety, y.capstan_error, y.capstan_counts, y.u_c, amperes, k)",
            "apart = machine.tape_apart(p, s, y.capstan, y.capstan_speed, y.reel1_counts, y.reel2_counts, y.R1, y.R2)",
            "safety.check_sensors(p.safety, s.safety, apart, k)",
            "safety.check_tension(p.safety, s.safety, y.tension1_estimate, y.tension2_estimate, k)",
            "safety.fade(p.safety, s.safety)",
        ),
    ),
    (
        "write",
        (
            "tx.ao_codes[0] = at_mio_16de.volts_to_codes(p.output1, safety.gate(p.safety, s.safety, u1, 0))",
            "tx.ao_codes[1] = at_mio_16de.volts_to_codes(p.output2, safety.gate(p.safety, s.safety, u2, 1))",
            "y.u1 = at_mio_16de.codes_to_volts(p.output1, tx.ao_codes[0])",
            "y.u2 = at_mio_16de.codes_to_volts(p.output2, tx.ao_codes[1])",
            *TRACE_LINES,
        ),
    ),
)


def stages(
    position: own_law.LawLines, more: compensation.Lines = compensation.NONE
) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Lines of the tick by stage, with the lines of the position law and of the compensation in place."""
    command = "s.machine.u_fb + y.w + s.hand_over.u" + more.extra
    put = {
        STEP: (*position.step, *more.filter),
        RESET: tuple(f"    {line}" for line in (*position.reset, *more.reset)),
        READ: more.read,
        REFERENCE: more.reference,
        ERROR: (f"y.capstan_error = y.ref{more.shift} - {more.closed or 'y.capstan'}",),
        COMMAND: (*more.law, f"y.u_c = {command}", *more.inverse),
        TRACK: more.track,
    }
    return tuple((name, tuple(part for line in body for part in put.get(line, (line,)))) for name, body in STAGES)
