"""Gain schedule over the reel radii with a gain margin at every radius.

    factor = factor nearest to K_p(reference) / K_p(radii) with which the loop has GM and PM

The loop gain stays at its design value as far as the margins allow. The phase margin is a limit as well: a resonance
near |L| = 1 may keep its gain margin and ring. The law interpolates the table, so the margins are checked between the
nodes as well, and the limits at the nodes are raised until every radius keeps its margins.

Source: thesis chapter 9 (gain scheduling on the reel radii is recommended); `laws/gain_schedule`, mode margin.
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.config.load import set_path
from rtctl.design import margins, response, robustness
from rtctl.design.robustness import RADII, Map
from rtctl.laws.gain_schedule import RadiusTableSettings

AT = 1.0  # Hz, where the process gain is taken
TRIES = 6
STEPS = 100  # of 2 % each, a factor of 7 either way


class Schedule(NamedTuple):
    """Table of the law, and margins without and with it, with the table between its nodes too."""

    table: RadiusTableSettings
    fixed: Map
    scheduled: Map


def design(
    config: Any,
    GM: float = 6.0,
    PM: float = 45.0,
    radii: Any = RADII,
    strongest: float = 2.0,
    printed: bool = False,
) -> Schedule:
    """Schedule with at least `GM` dB and `PM` deg for every pair of `radii` (m), and no factor above `strongest`.

    `printed` takes the law as the thesis prints it, without its filter, which has smaller gain margins.
    Raises NoAnswer where no factor gives the margins.
    """
    radii = np.asarray(radii, float)
    plain = with_mode(config, "off")
    fixed = robustness.over_radii(plain, radii, radii, printed=printed)
    K_p = np.array([[_process_gain(plain, a, b) for b in radii] for a in radii])
    reference = config.law.gain_schedule
    K_0 = _process_gain(plain, reference.R1_reference, reference.R2_reference)
    loops = [[_loop(plain, a, b, printed) for b in radii] for a in radii]
    between = np.sort(np.concatenate([radii, (radii[1:] + radii[:-1]) / 2]))
    more = np.zeros(2)
    for _ in range(TRIES):
        asked = np.array([GM, PM]) + more
        factor = [
            [_factor(*loop, wanted, strongest, asked) for loop, wanted in zip(*row, strict=True)]
            for row in zip(loops, K_0 / K_p, strict=True)
        ]
        if not np.isfinite(factor).all():
            i, j = np.argwhere(~np.isfinite(factor))[0]
            where = f"{1e3 * radii[i]:g}/{1e3 * radii[j]:g} mm"
            raise NoAnswer(
                f"no factor keeps {asked[0]:.3g} dB and {asked[1]:.3g} deg at {where}; ask for less, or give the loop "
                "more phase"
            )
        table = RadiusTableSettings(
            R_drive=radii.tolist(), R_other=radii.tolist(), factor=np.floor(1e4 * np.array(factor)) / 1e4
        )
        found = robustness.over_radii(with_table(config, table), between, between, printed=printed)
        short = np.array([GM - found.GM.min(), PM - found.PM.min()])
        if (short <= 0).all() and found.stable.all():
            return Schedule(table, fixed, found)
        more += np.maximum(short * 1.2, 0.0) + 0.02
    worst, R_drive, R_other = found.worst
    raise NoAnswer(
        f"no factor keeps {GM:g} dB and {PM:g} deg: {worst:.1f} dB and {found.PM.min():.0f} deg are left, the former "
        f"at {1e3 * R_drive:g}/{1e3 * R_other:g} mm; ask for less, or give the loop more phase"
    )


def _factor(f: np.ndarray, L: np.ndarray, wanted: float, strongest: float, asked: np.ndarray) -> float:
    """Factor nearest to `wanted` with which the loop `L` has the margins `asked`; nan where no factor has them."""
    wanted = min(wanted, strongest)
    steps = np.arange(-STEPS, STEPS + 1)
    tried = wanted * 1.02 ** steps[np.argsort(np.abs(steps), kind="stable")]
    for k in tried[tried <= strongest]:
        try:
            m = margins.points(f, k * L)
        except NoAnswer:  # the loop has no crossover
            continue
        if m.stable and m.GM >= asked[0] and m.PM >= asked[1]:
            return float(k)
    return float("nan")


def _loop(config: Any, R_drive: float, R_other: float, printed: bool) -> tuple[np.ndarray, np.ndarray]:
    parts = response.take(robustness.with_radii(config, R_drive, R_other))
    L, _ = margins.loops(parts, printed)
    f = np.geomspace(margins.LOW, margins.HIGH / parts.dt, 1500)
    return f, L(f)


def with_mode(config: Any, mode: str) -> Any:
    """The config with another mode of its gain schedule."""
    return set_path(config, "law.gain_schedule.mode", mode)


def with_table(config: Any, table: RadiusTableSettings) -> Any:
    """The config with a table and in mode `margin`."""
    made = set_path(config, "law.gain_schedule.table", table.model_dump())
    return with_mode(made, "margin")


def _process_gain(config: Any, R_drive: float, R_other: float) -> float:
    """K_p of the config's plant at these radii, in rad/s^2 per V."""
    P = response.plant(robustness.with_radii(config, R_drive, R_other), np.array([AT]))
    return float(np.abs(P[0])) * (2 * np.pi * AT) ** 2
