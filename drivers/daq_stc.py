"""The two 24-bit up/down counters of the AT-MIO-16DE-10's timing chip, the DAQ-STC.

A counter counts edges at its source. A DIO line gives the direction: line 6 for counter 0, line 7 for counter 1. It
starts at half its size, so that neither direction wraps soon. The reader on the loop side handles wraps, as long as a
tick has fewer than 2^23 counts.

Source: thesis 7.1.1 and appendix D; National Instruments, DAQ-STC Technical Reference Manual.
"""

from rtctl.idiom import state, tick

SIZE = 1 << 24
INITIAL_COUNT = SIZE // 2  # 8388608
DIO_LINE = (6, 7)  # direction of counter 0 and 1: high counts up

COUNTER_STATE = state(n=int)  # counts since the initial count, unwrapped
READER_STATE = state(n=int, previous=int, position=int)


@tick
def counter_step(s, pulses, up):
    """Count `pulses` (not negative) up or down by the DIO line (`up` 1 or 0); returns the code, 0 to 2^24 - 1."""
    s.n += pulses if up != 0 else -pulses
    return wrapped(INITIAL_COUNT + s.n)


@tick
def counter_reset(s):
    """Load the initial count again (ND_RESET, ND_INITIAL_COUNT, ND_PROGRAM)."""
    s.n = 0


@tick
def wrapped(counts):
    """Code of a counter at `counts`, which may be outside its range."""
    return counts & (SIZE - 1)


@tick
def difference(codes, previous):
    """Signed counts from code `previous` to `codes`, the shorter way around."""
    return wrapped(codes - previous + INITIAL_COUNT) - INITIAL_COUNT


@tick
def counter_position(s, codes):
    """Signed continuous counts since the initial count, from codes that wrap."""
    previous = s.previous if s.n != 0 else INITIAL_COUNT
    s.position += difference(codes, previous)
    s.previous = codes
    s.n += 1
    return s.position
