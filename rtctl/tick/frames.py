"""Frames between loop and plant: codes and counts, as in a board's registers.

A frame is a fixed little-endian record, over ZeroMQ and over shared memory. A frame of another version is refused.
"""

import numpy as np

from rtctl.idiom import tick
from rtctl.plants import linear

MAGIC = 0x4C544352  # "RCTL"
VERSION = 4
HELLO = -1  # sequence number of the hello frame, which a plant in lockstep waits for
AO_CHANNELS, COUNTERS, AI_CHANNELS, TRUTHS = linear.MOST_DRIVES, linear.MOST_SENSORS, 16, 2 * linear.MOST_BODIES

OUTPUTS = np.dtype(
    [
        ("magic", "<u4"),
        ("version", "<u4"),
        ("seq", "<i8"),  # counts up with every frame
        ("t_ns", "<i8"),  # sender's clock
        ("inputs_t_ns", "<i8"),  # plant's clock at the sample that these outputs answer; old: ignored
        ("ao_codes", "<i4", (AO_CHANNELS,)),
        ("dio_lines", "<u4"),  # digital lines, bit per line
        ("state", "<u4"),  # of the safety machine; 0 means outputs off
    ]
)
INPUTS = np.dtype(
    [
        ("magic", "<u4"),
        ("version", "<u4"),
        ("seq", "<i8"),
        ("t_ns", "<i8"),  # plant's clock when it sampled
        ("outputs_seq", "<i8"),  # number of the newest outputs received
        ("outputs_t_ns", "<i8"),  # t_ns of the newest outputs received, for the round-trip time
        ("counter_codes", "<u4", (COUNTERS,)),
        ("ai_codes", "<i4", (AI_CHANNELS,)),
        ("lost_counts", "<i8"),  # by the quadrature converters, since the start
        ("watchdog", "<i8"),  # times that the board's watchdog has set outputs to zero
        ("watchdog_seq", "<i8"),  # number of the outputs that the watchdog last set to zero
        ("truth", "<f8", (TRUTHS,)),  # true values of an emulator; NaN on a real machine
    ]
)


@tick
def valid(frame):
    """Whether a frame has the right magic number and version, and is no hello frame."""
    return frame.magic == MAGIC and frame.version == VERSION and frame.seq >= 0
