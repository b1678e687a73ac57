"""Position error of the encoder against the linear scale, and the capstan radius from its trend.

    e = x - x_hat,   x by the scale,   x_hat = R_c_hat theta_m        R_c - R_c_hat = R_c_hat de/dx_hat   (11.2), (11.3)

The record is taken at 500 Hz and filtered forwards and backwards with a second-order Butterworth of 50 Hz, as in the
thesis. The thesis measures during the print of a grey image in steps of 1/12 mm. Here the carriage runs at one speed,
which gives the same error over position in half a minute instead of an hour.

Source: thesis 11.2, figure 11.6.
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.identify.bench import changed, counts_per_turn, need, ramps
from rtctl.identify.records import Record
from rtctl.machines.profile import SCALE

RATE = 500.0  # Hz
CUTOFF = 50.0  # Hz
LEAST = 0.1  # m of travel: five turns of the capstan
BLOCK = 0.01885  # m, a turn of the capstan: errors within a turn are correlated


class Pass(NamedTuple):
    """One way along the scale at constant speed."""

    x: np.ndarray  # m, (n,), by the encoder, from the start of the pass
    e: np.ndarray  # m, (n,), scale - encoder, filtered, 0 at the start
    speed: float  # m/s
    start: float  # m, where it began


class ScaleError(NamedTuple):
    slope: float  # m/m
    half: float  # m/m, half width of the 95 % interval
    rise: float  # m, of the trend over the travel
    travel: float  # m
    radius_error: float  # m, R_c - R_c_hat
    radius_half: float  # m, half width of the 95 % interval
    periodic: float  # m, rms of the residual of the trend


def scale_config(config: Any, travel: float = 0.6, speed: float = 0.02) -> Any:
    """Config that runs `travel` m at `speed` m/s, plus a run-up that `passes` leaves out."""
    need(config.kind, config.name, SCALE)
    more = RUN_UP * speed  # s of it at either end
    step = {"at": 0.3, "to": travel + 2.0 * more, "ramp": speed}
    return changed(config, {"law.shaper": {}, "reference": {"steps": [step]}})


RUN_UP = 0.5  # s


def passes(record: Record, travel: float | None = None) -> list[Pass]:
    """Passes of at least 0.1 m at constant speed, cut to `travel` m where it is given.

    Raises NoAnswer where no pass is long enough.
    """
    from scipy.signal import butter, sosfiltfilt

    need(record.kind, record.source, SCALE)
    t, target, scale = record["t"], record["target"], record["scale"]
    R_c = record.config.sensors.R_c
    encoder = record["encoder_counts"] * (2.0 * np.pi / counts_per_turn(record)) * R_c
    every = max(round((1.0 / record.dt) / RATE), 1)
    sos = butter(2, CUTOFF, fs=(1.0 / record.dt) / every, output="sos")
    found, longest = [], 0.0
    for begin, end in ramps(t, target, least=0.5):
        rows = slice(begin, end, every)
        x = encoder[rows]
        if abs(x[-1] - x[0]) < LEAST:
            continue
        # scale and encoder have different counts: the filter removes both quantisation steps
        e = sosfiltfilt(sos, scale[rows] - x)
        speed = (x[-1] - x[0]) / (t[rows][-1] - t[begin])
        way = np.abs(sosfiltfilt(sos, x) - x[0])
        inside = (way > RUN_UP * abs(speed)) & (way < way[-1] - RUN_UP * abs(speed) * 0.9)
        first = int(np.argmax(inside))
        way, e = way[inside] - way[first], e[inside] * np.sign(speed)
        longest = max(longest, float(way[-1]))
        if travel is not None:
            if way[-1] < travel * (1 - 1e-3):
                continue
            keep = int(np.argmax(way >= min(travel, way.max()))) + 1
            way, e = way[:keep], e[:keep]
        found.append(Pass(way, e - e[0], float(abs(speed)), float(x[first])))
    if not found:
        wanted = f"{1e3 * (travel or LEAST):.0f} mm"
        raise NoAnswer(
            f"{record.source}: no pass of {wanted} at constant speed; the longest has {1e3 * longest:.0f} mm"
        )
    return found


def scale_error(x: np.ndarray, e: np.ndarray, R_c: float) -> ScaleError:
    """Trend of the error `e` (m, (n,)) over the encoder position `x` (m, (n,)), for the nominal radius `R_c` (m).

    A straight line by least squares. The interval counts a turn of the capstan as one sample: the residual is periodic
    and no white noise. Raises NoAnswer for a travel below 0.1 m.
    """
    travel = float(np.ptp(x))
    if travel < LEAST:
        raise NoAnswer(f"the travel of {1e3 * travel:.1f} mm is too short for a trend; it takes {1e3 * LEAST:.0f} mm")
    slope, level = np.polyfit(x, e, 1)
    rest = e - (slope * x + level)
    blocks = max(travel / BLOCK, 3.0)
    half = 2.0 * float(np.sqrt(np.mean(rest**2) / (blocks - 2.0)) / np.std(x))
    return ScaleError(
        float(slope),
        half,
        float(slope * travel),
        travel,
        float(slope * R_c),
        half * R_c,
        float(np.sqrt(np.mean(rest**2))),
    )
