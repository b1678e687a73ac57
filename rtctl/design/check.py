"""Loop gain of a config measured on the emulator in a fused run, and its margins.

    S = U_c / W        L = 1 / S - 1

A periodic multisine w is added to the command while the machine holds its position; u_c is the command of the loop
with w in it. Dry friction is left out of model and emulator, since the designed loop is linear. The record holds whole
periods of the multisine, so there is no leakage, and the only noise is quantisation.

Source: thesis 8.1 and 12.3 (sensitivity); Pintelon & Schoukens, System Identification (2012), section 4.3.
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.config.load import set_path, set_paths
from rtctl.design import margins, response
from rtctl.design.margins import Margins
from rtctl.loop import fused
from rtctl.machines.base import DESCRIBED
from rtctl.machines.profiles import profile_of
from rtctl.tick import safety

PERIODS = 3  # averaged, after one period in which the transient of the start decays
SURE = 0.05  # deviation of the mean loop gain over the periods, above which a line is left out


class Measured(NamedTuple):
    """Loop gain as measured, and its margins."""

    f: np.ndarray  # (n,) Hz
    L: np.ndarray  # (n,)
    margins: Margins


def experiment(config: Any, rms: float, period: float = 2.0, f_max: float | None = None) -> Any:
    """Config of the experiment: fused, without dry friction, with a multisine of `rms` V up to `f_max` Hz.

    A reel unit gets motor 1 alone for its position, so that the loop does not change hands at every zero of the
    command. `f_max` is 0.4 of the sample rate if absent.
    """
    if config.kind == DESCRIBED:
        still = {f"machine.bodies.{name}.dry": 0.0 for name in config.machine.bodies}
    else:
        still = dict(profile_of(config.kind).frictionless)
    values: dict[str, Any] = {**still, "loop.mode": "fused", "loop.write": config.loop.write}
    values |= profile_of(config.kind).alone
    config = set_paths(config, values)
    f_max = f_max or 0.4 * config.loop.rate
    config = set_path(config, "reference", {})
    return set_path(
        config,
        "excitation",
        {"kind": "multisine", "rms": rms, "f_min": 0.9 / period, "f_max": f_max, "period": period, "seed": 1},
    )


def measure(config: Any, rms: float, period: float = 2.0, f_max: float | None = None) -> Measured:
    """Loop gain and margins of a config on its emulator.

    Raises NoAnswer where the run trips, the output is limited or most lines are noise: the run then does not show the
    linear loop.
    """
    played = experiment(config, rms, period, f_max)
    run = fused.run(played, (PERIODS + 1) * period + 2.0)
    if run.tripped:
        raise NoAnswer(f"the run tripped ({run.tripped}) at {run.trip_time:.3g} s; lower rms")
    n = round(period * played.loop.rate)
    first = int(np.argmax(run["state"] == safety.RUNNING)) + n
    rows = run.rows[first : first + PERIODS * n]
    limited = np.abs(rows["u_c"]) >= played.law.limit.high
    if limited.any():
        raise NoAnswer(f"the output is limited at {rows['t'][np.argmax(limited)]:.3g} s; lower rms from {rms:g} V")
    w, u = (np.fft.rfft(rows[name].reshape(PERIODS, n), axis=1) for name in ("w", "u_c"))
    lines = np.flatnonzero(np.abs(w[0]) > 0.3 * np.abs(w[0]).max())
    each = w[:, lines] / u[:, lines] - 1
    L = w[:, lines].sum(axis=0) / u[:, lines].sum(axis=0) - 1
    deviation = np.sqrt((np.abs(each - L) ** 2).sum(axis=0) / (PERIODS - 1) / PERIODS)
    sure = deviation < SURE * np.maximum(np.abs(L), 1.0)
    if sure.mean() < 0.5:
        noisy = lines[~sure] / period
        raise NoAnswer(
            f"{noisy.size} of {len(lines)} lines, {noisy[0]:g} to {noisy[-1]:g} Hz, differ from period to period: "
            f"take more rms than {rms:g} V, or fewer lines (f_max)"
        )
    f, L = lines[sure] / period, L[sure]
    parts = response.take(played)
    share = response.law_response(parts, f, "reference") / response.law_response(parts, f)
    return Measured(f, L, margins.points(f, L, share * L))
