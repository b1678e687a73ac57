"""The safety state machine: states idle, armed, running and tripped, and the causes of a trip.

    idle     outputs at zero
    armed    outputs on; the machine moves to its starting point and holds it
    running  follows the reference
    tripped  outputs go to zero, from the tick of the trip on; only `reset` leads back to idle

A trip latches its first cause. A limit of 0 (or infinity) is switched off.

Source: the state machine of IEC 61800-7 drives, reduced to what a bench needs.
"""

from typing import NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, guard, quantity, state, tick
from rtctl.tick import frames

IDLE, ARMED, RUNNING, TRIPPED = range(4)
STATES = ("idle", "armed", "running", "tripped")

(
    NONE, LINK, FROZEN, FOLLOWING, TENSION, CURRENT, NOT_A_NUMBER, MISSED, COMMANDER, START_UP, SUPERVISOR, SENSORS,
    WATCHDOG,
) = range(13)  # fmt: skip
TRIPS = {
    NONE: ("none", "no trip"),
    LINK: ("link_lost", "the plant or board has sent nothing for too long: is it running, is the cable in?"),
    FROZEN: ("encoder_frozen", "the drive pulls and the encoder does not move: blocked machine or dead encoder"),
    FOLLOWING: ("following_error", "the machine is too far from its reference"),
    TENSION: ("tension", "the estimated tape tension is out of range: torn, folded or jammed tape"),
    CURRENT: ("current_time", "the drive has been asked for more than its continuous current for too long"),
    NOT_A_NUMBER: ("not_a_number", "a signal or the law's output is not a number"),
    MISSED: (
        "missed_ticks",
        "too many ticks in a row came late or not at all: the loop stood still, or cannot hold this rate",
    ),
    COMMANDER: ("commander_lost", "nobody has talked to the command socket for too long, and the config requires it"),
    START_UP: ("start_up", "the start-up routine did not find the reel radii"),
    SUPERVISOR: ("supervisor_lost", "the supervisor has died or hangs: nobody could take a disarm"),
    SENSORS: (
        "sensors_disagree",
        "two sensors of one motion disagree: dead encoder, missed counts, slip, torn tape, or reels of other radii",
    ),
    WATCHDOG: (
        "board_watchdog",
        "the board took its outputs to zero by itself: nothing came from the loop for longer than safety.link_timeout",
    ),
}


class SafetySettings(Settings):
    link_timeout: float = quantity(
        0.05, unit="s", safer="smaller", gt=0, help="longest time without a frame from plant or board"
    )
    frozen_time: float = quantity(
        0.2, unit="s", safer="smaller", off=0.0, ge=0, help="longest effort without a count; 0 switches it off"
    )
    frozen_effort: float = quantity(
        1.0, unit="V", safer="smaller", gt=0, help="command above which something should move"
    )
    following_error: float = quantity(
        0.0, unit="", safer="smaller", off=0.0, ge=0, help="largest error, rad or m; 0 switches it off"
    )
    tension_min: float = quantity(-1e9, unit="N", safer="larger", help="lowest estimated tension while running")
    tension_max: float = quantity(1e9, unit="N", safer="smaller", help="highest estimated tension while running")
    tension_time: float = quantity(
        0.05, unit="s", safer="smaller", ge=0, help="how long the tension may be out of range"
    )
    current: float = quantity(1.0, unit="A", safer="smaller", gt=0, help="continuous current of a drive")
    current_time: float = quantity(
        2.0, unit="s", safer="smaller", off=0.0, ge=0, help="how long it may be exceeded; 0 switches it off"
    )
    missed_ticks: int = Field(
        default=10,
        ge=0,
        json_schema_extra=guard("smaller", 0),
        description="late ticks in a row that trip; 0 switches it off",
    )
    require_commander: bool = Field(
        default=False, json_schema_extra=guard("larger"), description="trip where nobody commands, or sends a ping"
    )
    commander_timeout: float = quantity(
        1.0, unit="s", safer="smaller", gt=0, help="how long the commander may be silent"
    )
    supervisor_timeout: float = quantity(
        2.0,
        unit="s",
        safer="smaller",
        off=0.0,
        ge=0,
        help="how long the supervisor, which takes disarm, may be silent; 0 switches it off",
    )
    disagreement: float = quantity(
        0.0,
        unit="m",
        safer="smaller",
        off=0.0,
        ge=0,
        help="most that two sensors of one motion may come apart after arming; 0 switches it off",
    )
    ramp: float = quantity(
        0.0, unit="s", safer="smaller", ge=0, help="time in which a trip takes the outputs to zero; 0 is at once"
    )


class SafetyParams(NamedTuple):
    """Limits; times in periods of the loop, counted by the clock, including periods without a tick."""

    link: int
    frozen: int
    frozen_effort: float
    following: float
    tension_min: float
    tension_max: float
    tension: int
    current: float
    current_time: int
    missed: int
    disagreement: float  # m
    fade: float  # fraction of the output by which it falls each period after a trip
    commander: int  # ns for which the commander may be silent; 0 where none is required
    supervisor: int  # ns for which the supervisor may be silent; 0 for no limit


SAFETY_STATE = state(
    state=int,
    trip=int,
    trip_tick=int,
    arm=int,  # requests seen
    disarm=int,
    reset=int,
    passed=int,  # periods since the previous tick
    armed_for=int,  # periods in `armed`
    silent=int,  # periods without a frame
    still=int,  # periods with effort and without a count
    over=int,  # periods above the continuous current
    slack=int,  # periods with a tension out of range
    late=int,  # periods of consecutive late ticks
    counts=int,  # encoder counts of the previous sample
    apart=float,  # difference of two sensors at switch-on of the outputs, m
    hold=(float, frames.AO_CHANNELS),  # outputs of the last tick before the trip, V
    gate=float,  # fraction of `hold` that is written: 1, falling to 0 after a trip
    on=int,  # 1 in the tick in which the outputs are switched on
    board=int,  # trips of the board's watchdog, by the board
    off_seq=int,  # number of the latest outputs that were off
    watchdog=int,  # trips of the board's watchdog with outputs on since the latest arming
    watchdog_seen=int,  # value of `watchdog` in the previous tick
)


def build(settings: SafetySettings, dt: float) -> SafetyParams:
    """Limits in periods of `dt` s. Raises ValueError where the tension range is empty."""
    if settings.tension_min >= settings.tension_max:
        raise ValueError(f"tension_min {settings.tension_min:g} N is not below tension_max {settings.tension_max:g} N")
    return SafetyParams(
        link=max(round(settings.link_timeout / dt), 1),
        frozen=round(settings.frozen_time / dt),
        frozen_effort=settings.frozen_effort,
        following=settings.following_error,
        tension_min=settings.tension_min,
        tension_max=settings.tension_max,
        tension=round(settings.tension_time / dt),
        current=settings.current,
        current_time=round(settings.current_time / dt),
        missed=settings.missed_ticks,
        disagreement=settings.disagreement,
        fade=1.0 if settings.ramp <= dt else dt / settings.ramp,
        commander=round(settings.commander_timeout * 1e9) if settings.require_commander else 0,
        supervisor=round(settings.supervisor_timeout * 1e9),
    )


@tick
def trip(s, cause, k):
    """Trip with a cause in tick `k`, if the outputs are on (armed or running)."""
    if s.state == ARMED or s.state == RUNNING:
        s.state = TRIPPED
        s.trip = cause
        s.trip_tick = k


@tick
def command(s, c, passed):
    """Carry out requests: arm leads from idle to armed, disarm to idle, reset from tripped to idle. Sets s.on.

    `passed` is the number of periods since the previous tick, by the clock: 1 where none was missed.
    """
    s.on = 0
    s.passed = passed
    if c.reset != s.reset:
        s.reset = c.reset
        if s.state == TRIPPED:
            s.state = IDLE
            s.trip = NONE
    if c.disarm != s.disarm:
        s.disarm = c.disarm
        if s.state != TRIPPED:
            s.state = IDLE
    if c.arm != s.arm:
        s.arm = c.arm
        if s.state == IDLE:
            s.state = ARMED
            s.on = 1
            s.passed = 1  # periods missed while the outputs were off do not count
            s.armed_for = 0
            s.gate = 1.0
            s.hold[:] = 0.0  # a trip in this tick has no outputs to fade
            s.silent = 0
            s.still = 0
            s.over = 0
            s.slack = 0
            s.late = 0
    if s.state == ARMED:
        s.armed_for += s.passed


@tick
def check_timing(p, s, c, fresh, late, gone, watchdog, k):
    """Trip for link, lateness, commander, supervisor or board watchdog, at the start of tick `k`.

    `fresh` is the number of new frames. `late` is 1 for a late tick. `gone` is the result of `gone`: COMMANDER,
    SUPERVISOR or 0. `watchdog` is the count of `board_watchdog`.
    """
    s.silent = 0 if fresh > 0 else s.silent + s.passed
    s.late = s.late + s.passed if late != 0 else 0
    if s.silent > p.link:
        trip(s, LINK, k)
    if p.missed > 0 and s.late >= p.missed:
        trip(s, MISSED, k)
    if c.commander_lost != 0:
        trip(s, COMMANDER, k)
    if gone != 0:
        trip(s, gone, k)
    if watchdog != s.watchdog_seen:
        s.watchdog_seen = watchdog
        trip(s, WATCHDOG, k)


@tick
def board_watchdog(s, rx, tx):
    """Count of board watchdog trips whose outputs were on since the latest arming.

    Reports about earlier outputs may arrive late, after a cut cable; they do not trip a new start.
    """
    if s.state != ARMED and s.state != RUNNING:
        s.off_seq = tx.seq
        s.board = rx.watchdog  # of an earlier run, or of outputs that were off
    elif rx.watchdog != s.board:
        s.board = rx.watchdog
        if rx.watchdog_seq > s.off_seq:
            s.watchdog += 1
    return s.watchdog


@tick
def gone(p, now, commander, supervisor):
    """Trip cause at time `now` for a silent commander or supervisor: COMMANDER, SUPERVISOR, or 0. Times in ns.

    `commander` and `supervisor` are the times of their last sign of life; 0 where they are not recorded.
    """
    if p.commander > 0 and commander > 0 and now - commander > p.commander:
        return COMMANDER
    if p.supervisor > 0 and supervisor > 0 and now - supervisor > p.supervisor:
        return SUPERVISOR
    return 0


@tick
def check_sensors(p, s, apart, k):
    """Trip where two sensors of one motion, which differ by `apart` m, have moved apart since switch-on."""
    if s.on != 0:
        s.apart = apart
    if p.disagreement > 0.0 and abs(apart - s.apart) > p.disagreement:
        trip(s, SENSORS, k)


@tick
def check_motion(p, s, error, counts, effort, amperes, k):
    """Trip for following error (rad or m), frozen encoder despite `effort` (V), current (A), or NaN."""
    total = error + effort + amperes
    if total != total or abs(total) > 1e300:
        trip(s, NOT_A_NUMBER, k)
    if p.following > 0.0 and abs(error) > p.following:
        trip(s, FOLLOWING, k)
    if s.silent == 0:  # only a new sample can show a frozen encoder
        s.still = s.still + s.passed if counts == s.counts and abs(effort) > p.frozen_effort else 0
        s.counts = counts
    if p.frozen > 0 and s.still > p.frozen:
        trip(s, FROZEN, k)
    s.over = s.over + s.passed if amperes > p.current else 0
    if p.current_time > 0 and s.over > p.current_time:
        trip(s, CURRENT, k)


@tick
def check_number(s, u, k):
    """Trip where the law's command `u` (V) is not a finite number; call before limits, which would hide it."""
    if not abs(u) <= 1e300:
        trip(s, NOT_A_NUMBER, k)


@tick
def check_tension(p, s, T1, T2, k):
    """Trip where an estimated tension `T1` or `T2`, N, is out of range for too long while running."""
    out = min(T1, T2) < p.tension_min or max(T1, T2) > p.tension_max
    s.slack = s.slack + s.passed if out and s.state == RUNNING else 0
    if s.slack > p.tension:
        trip(s, TENSION, k)


@tick
def gate(p, s, u, channel):
    """Output voltage of a channel, V: `u` while on, the fading last output after a trip, else 0."""
    if s.state == ARMED or s.state == RUNNING:
        s.hold[channel] = u if u == u else 0.0
        return s.hold[channel]
    if s.state == TRIPPED:
        return s.hold[channel] * s.gate
    return 0.0


@tick
def fade(p, s):
    """Reduce the fraction of the outputs that is still written after a trip. Call once a tick, before `gate`."""
    if s.state == TRIPPED:
        s.gate = max(s.gate - p.fade * s.passed, 0.0)
