"""What crosses the bus between loop and plant: codes and counts, as a board's registers hold them.

Fixed little-endian records, the same over ZeroMQ and shared memory. A frame of another version is refused.
"""

import numpy as np

from rtctl.idiom import tick
from rtctl.plants import linear

MAGIC = 0x4C544352  # "RCTL"
VERSION = 4
HELLO = -1  # sequence number of the frame with which a loop wakes a plant that waits for it
AO_CHANNELS, COUNTERS, AI_CHANNELS, TRUTHS = linear.MOST_DRIVES, linear.MOST_SENSORS, 16, 2 * linear.MOST_BODIES

OUTPUTS = np.dtype(
    [
        ("magic", "<u4"),
        ("version", "<u4"),
        ("seq", "<i8"),  # counts up with every frame
        ("t_ns", "<i8"),  # sender's clock
        ("inputs_t_ns", "<i8"),  # plant's clock at the sample that these outputs answer; old ones are not acted on
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
        ("outputs_seq", "<i8"),  # newest outputs seen
        ("outputs_t_ns", "<i8"),  # and the clock they carried, for the round trip
        ("counter_codes", "<u4", (COUNTERS,)),
        ("ai_codes", "<i4", (AI_CHANNELS,)),
        ("lost_counts", "<i8"),  # by the quadrature converters, since the start
        ("watchdog", "<i8"),  # times that the board has taken its outputs to zero by itself
        ("watchdog_seq", "<i8"),  # the outputs that it did that to, latest
        ("truth", "<f8", (TRUTHS,)),  # what only an emulator knows; NaN on a real machine
    ]
)


@tick
def valid(frame):
    """Whether a frame is ours, of this version, and more than a hello."""
    return frame.magic == MAGIC and frame.version == VERSION and frame.seq >= 0
