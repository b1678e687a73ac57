"""Preparation of recorded columns: running rows, an even clock, counters without wraps."""

import math

import numpy as np

from rtctl.drivers import ldu_amplifier

WRAPS = (16, 24, 32)  # bits of the counters in use
ARMED, RUNNING = 1, 2  # in the column `state` of recordings by rtctl


def running(state: np.ndarray) -> slice:
    """Longest run of rows in which the loop of rtctl ran: neither armed nor stopped by a trip."""
    edges = np.diff(np.concatenate(([0], state == RUNNING, [0])).astype(np.int8))
    first, last = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    if not len(first):
        return slice(0, 0)
    longest = int(np.argmax(last - first))
    return slice(int(first[longest]), int(last[longest]))


def armed(state: np.ndarray, start: int) -> slice:
    """Rows before row `start` in which the law ran while the loop was armed."""
    others = np.flatnonzero(state[:start] != ARMED)
    return slice(int(others[-1]) + 1 if len(others) else 0, start)


def through_amplifier(u: np.ndarray) -> np.ndarray:
    """Volts (n,) at which a gain of 0.1 A/V gives the current of the measured amplifier at `u`, below its runaway.

    At 0 V the amplifier still gives a current, whose direction is the sign of the zero (12.3).
    """
    offset, knee = ldu_amplifier.OFFSET_VOLTS, ldu_amplifier.KNEE_VOLTS
    return np.copysign(offset + np.maximum(np.abs(u) - knee, 0.0), u)


def even_clock(t: np.ndarray, dt: float) -> np.ndarray:
    """Times (m,) s, `dt` apart, from the first to the last of the uneven times `t` (n,)."""
    return t[0] + dt * np.arange(int((t[-1] - t[0]) / dt + 1e-9) + 1)


def laid(even: np.ndarray, t: np.ndarray, values: np.ndarray, whole: bool = False) -> np.ndarray:
    """Readings (n,) at times `t` on the line between neighbours at times `even`; a counter stays `whole`."""
    line = np.interp(even, t, values)
    return np.round(line) if whole else line


def unwrap(counts: np.ndarray) -> tuple[np.ndarray, int | None, int]:
    """Counts (n,) without the wraps of their counter, the counter's bits (None: it never wrapped), wraps."""
    d = np.diff(counts)
    span = float(np.ptp(counts)) if len(counts) else 0.0
    for bits in WRAPS:
        if span >= 2.0**bits:
            continue
        wrapped = np.abs(d) > 0.5 * 2.0**bits
        if not wrapped.any():
            continue
        left = d - np.sign(d) * 2.0**bits
        if np.abs(left[wrapped]).max() < 2.0 ** (bits - 4):  # the corrected step is of ordinary size
            d = np.where(wrapped, left, d)
            return counts[0] + np.concatenate(([0.0], np.cumsum(d))), bits, int(wrapped.sum())
    return counts.copy(), None, 0


def unwrap_turns(angle: np.ndarray) -> np.ndarray:
    """Angle (n,) in rad without jumps of a turn; unchanged where it has none."""
    return np.unwrap(angle) if (np.abs(np.diff(angle)) > math.pi).any() else angle


def is_counter(name: str) -> bool:
    """Whether the column `name` holds counts."""
    return name.endswith("_counts")
