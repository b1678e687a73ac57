"""The invariants by name, and the compiled pass that checks a block of rows for all of them.

The pass uses two records. WINDOWS holds limits of the machine and the player's expectations for the coming ticks. CARRY
holds the state from block to block. Rows are read as a matrix, so one compiled function serves every machine. A check
takes a tenth of the time of the tick that made the row.
"""

import numpy as np
from numba import njit

from rtctl.idiom import state
from rtctl.tick.memory import borrowed
from rtctl.tick.safety import ARMED, IDLE, RUNNING, TRIPPED, TRIPS
from rtctl.tick.safety import NONE as NO_TRIP

INVARIANTS = {
    "output_limits": "outputs stay within the limits of law and converter",
    "outputs_off": "outputs are zero when idle, and after a trip no more than the fade leaves of them",
    "finite": "no signal is NaN or infinite",
    "tension": "tape tension stays within its limits, and trips where it does not",
    "counters": "counts agree with where the emulated machine is",
    "ring": "ticks = rows recorded + losses counted, and no tick number is left out",
    "state_machine": "only transitions that the safety machine knows, and only when asked for",
    "trip_latched": "a trip keeps its cause until reset",
    "trip_without_cause": "nothing trips while nothing is wrong",
    "must_trip": "what exceeds a limit, or a fault that must trip, has tripped in time",
    "settled": "an undisturbed move ends within tolerance of its target",
    "order": "the number of the newest order never falls, and none is from the future",
    "recovery": "after a fault, reset and arm lead back to running",
    "memory": "the memory of the process stays flat once it has warmed up",
}
NAMES = tuple(INVARIANTS)
(
    OUTPUT_LIMITS, OUTPUTS_OFF, FINITE, TENSIONS, COUNTERS, RING, STATE_MACHINE, TRIP_LATCHED, TRIP_WITHOUT_CAUSE,
    MUST_TRIP, SETTLED, ORDER, RECOVERY, MEMORY,
) = range(len(NAMES))  # fmt: skip
NEVER = 2**62
MOST_FOUND = 256  # violations kept of one block; further ones are only counted
LONGEST_LINK = 1.0  # s without a frame after which any machine must trip, even with a longer safety.link_timeout
BIGGEST = np.finfo(np.float64).max
FADE_VOLTS = 1e-9  # V, rounding of the arithmetic

WINDOWS = state(
    # columns of the matrix; -1 for none
    state=int, trip=int, age=int, lateness=int, order=int, position=int, error=int, counts=int, truth=int,
    outputs=(int, 2), n_outputs=int, tensions=(int, 4), n_tensions=int,  # estimates first, then the truth
    empty=(int, 8), n_empty=int,  # truth columns that this plant leaves empty
    # limits
    low=float, high=float, rounding=float, fade=float,  # V, V, V between law and row, share a tick
    tension_min=float, tension_max=float, tension_ticks=int,
    link_ticks=int, following=float, late=float, missed=int,  # ticks, unit of the reference, s, ticks
    per_unit=float, counts_off=float,  # counts per unit of truth; largest difference in counts
    tolerance=float,  # largest distance from a target, unit of the reference
    # expectations of the player
    quiet_from=int,  # no fault is active from this tick on, so nothing may trip
    counts_from=int,  # counts are comparable from this tick on
    settled_from=int, target=float,  # from this tick on the position is at the target
    must_by=int, must_above=int,  # by tick must_by there must be more trips than must_above
    arm=int, disarm=int, reset=int, newest=int,  # numbers of the newest orders of each kind
)  # fmt: skip
CARRY = state(
    tick=int,  # number of the next row
    state=int, trip=int, order=int,
    slack=int, late=int, faded=int,  # ticks in a row; ticks since the trip
    hold=(float, 2),  # outputs of the last tick, or of the last one before the trip
    base=float, has_base=int,  # counts less truth, at the first comparison
    trips=int, by_cause=(int, len(TRIPS)),
    rows=int, lost=int,
    checked=(int, len(NAMES)), episodes=(int, len(NAMES)), last_bad=(int, len(NAMES)),
    found=int,
)  # fmt: skip
FOUND = np.dtype([("code", "i8"), ("tick", "i8"), ("value", "f8"), ("bound", "f8")], align=True)

compiled = njit(nogil=True, error_model="numpy", cache=True)


@compiled
def note(s, found, code, k, value, bound):
    """Keep one violation for a run of consecutive ticks, with the value found and the bound."""
    if s.last_bad[code] != k - 1:
        s.episodes[code] += 1
        if s.found < len(found):
            found[s.found].code = code
            found[s.found].tick = k
            found[s.found].value = value
            found[s.found].bound = bound
            s.found += 1
    s.last_bad[code] = k


@compiled
def check(rows, ticks, windows, carry, found):
    """Check every row of `rows` (n, columns), whose tick numbers are `ticks` (n,)."""
    rows, ticks, found = borrowed(rows), borrowed(ticks), borrowed(found)
    w, s = borrowed(windows)[0], borrowed(carry)[0]
    for i in range(len(rows)):
        y, k = rows[i], ticks[i]
        _ring(s, found, k)
        _finite(w, s, found, y, k)
        now, on = int(y[w.state]), y[w.state] == ARMED or y[w.state] == RUNNING
        _outputs(w, s, found, y, k, now)
        _states(w, s, found, y, k, now)
        _motion(w, s, found, y, k, on, now)
        s.state, s.trip, s.order = now, int(y[w.trip]), int(y[w.order])
    for code in (OUTPUT_LIMITS, OUTPUTS_OFF, FINITE, RING, STATE_MACHINE, TRIP_LATCHED, TRIP_WITHOUT_CAUSE, MUST_TRIP,
                 ORDER):  # fmt: skip
        s.checked[code] += len(rows)


@compiled
def _ring(s, found, k):
    if k != s.tick:
        note(s, found, RING, k, float(k), float(s.tick))
    s.tick = k + 1
    s.rows += 1


@compiled
def _finite(w, s, found, y, k):
    fine = True
    for j in range(len(y)):
        fine &= abs(y[j]) <= BIGGEST
    if not fine:
        worst = -1
        for j in range(len(y)):
            if not abs(y[j]) <= BIGGEST and not _is_empty(w, j):
                worst = j
        if worst >= 0:
            note(s, found, FINITE, k, y[worst], float(worst))


@compiled
def _is_empty(w, j):
    found = False
    for n in range(w.n_empty):
        found |= w.empty[n] == j
    return found


@compiled
def _outputs(w, s, found, y, k, now):
    s.faded = s.faded + 1 if now == TRIPPED else 0
    left = max(1.0 - s.faded * w.fade, 0.0) if now == TRIPPED else 0.0
    for n in range(w.n_outputs):
        u = y[w.outputs[n]]
        if u < w.low or u > w.high:
            note(s, found, OUTPUT_LIMITS, k, u, w.high if u > 0.0 else w.low)
        if now in (ARMED, RUNNING):
            s.hold[n] = u
            continue
        if now == IDLE:
            s.hold[n] = 0.0
        most = abs(s.hold[n]) * left + (w.rounding if left > 0.0 else 0.0) + FADE_VOLTS
        if abs(u) > most:
            note(s, found, OUTPUTS_OFF, k, u, most)


@compiled
def _states(w, s, found, y, k, now):
    order, cause = int(y[w.order]), int(y[w.trip])
    if order < s.order or order > w.newest:
        note(s, found, ORDER, k, float(order), float(w.newest))
    if now != s.state and not _legal(w, s, now, order):
        note(s, found, STATE_MACHINE, k, float(now), float(s.state))
    tripped = now == TRIPPED and s.state != TRIPPED
    if (now == TRIPPED) != (cause != NO_TRIP) or (now == TRIPPED and s.state == TRIPPED and cause != s.trip):
        note(s, found, TRIP_LATCHED, k, float(cause), float(s.trip))
    if tripped:
        s.trips += 1
        if 0 <= cause < len(s.by_cause):
            s.by_cause[cause] += 1
        if k >= w.quiet_from:
            note(s, found, TRIP_WITHOUT_CAUSE, k, float(cause), 0.0)
    if k == w.must_by and s.trips <= w.must_above:
        note(s, found, MUST_TRIP, k, float(s.trips), float(w.must_above + 1))


@compiled
def _legal(w, s, now, order):
    """Whether the safety machine has the transition from the previous state to `now`, by an order in this tick."""
    if s.state == IDLE:
        return now != RUNNING and s.order < w.arm <= order
    if s.state == TRIPPED:
        return now == IDLE and s.order < w.reset <= order
    if now == IDLE:
        return s.order < w.disarm <= order
    return now == TRIPPED or (s.state == ARMED and now == RUNNING)


@compiled
def _motion(w, s, found, y, k, on, now):
    if on:
        if w.following > 0.0 and abs(y[w.error]) > w.following:
            note(s, found, MUST_TRIP, k, y[w.error], w.following)
        if y[w.age] > w.link_ticks:
            note(s, found, MUST_TRIP, k, y[w.age], float(w.link_ticks))
    s.late = s.late + 1 if on and y[w.lateness] > w.late else 0
    if w.missed > 0 and s.late >= w.missed:
        note(s, found, MUST_TRIP, k, float(s.late), float(w.missed))
    if now == RUNNING and k >= w.settled_from:
        s.checked[SETTLED] += 1
        if abs(y[w.position] - w.target) > w.tolerance:
            note(s, found, SETTLED, k, y[w.position], w.target)
    if w.n_tensions > 0 and now == RUNNING:
        _tension(w, s, found, y, k)
    elif w.n_tensions > 0:
        s.slack = 0
    if w.truth >= 0 and k >= w.counts_from:
        s.checked[COUNTERS] += 1
        off = y[w.counts] - w.per_unit * y[w.truth]
        if s.has_base == 0:
            s.base, s.has_base = off, 1
        if abs(off - s.base) > w.counts_off:
            note(s, found, COUNTERS, k, off, s.base)


@compiled
def _tension(w, s, found, y, k):
    s.checked[TENSIONS] += 1
    half = w.n_tensions // 2
    out = 0
    for n in range(w.n_tensions):
        T = y[w.tensions[n]]
        if T < w.tension_min or T > w.tension_max:
            if n < half:
                out = 1
            elif k >= w.quiet_from:
                note(s, found, TENSIONS, k, T, w.tension_max if T > w.tension_max else w.tension_min)
    s.slack = s.slack + 1 if out != 0 else 0
    if s.slack > w.tension_ticks:
        note(s, found, TENSIONS, k, float(s.slack), float(w.tension_ticks))
