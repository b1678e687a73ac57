"""Margins of an improved loop on the fitted model, with the small-signal responses of its effects.

    L = P H K        P: linear model, times the responses of delays and lags, with the dynamic stiffness of effects

An effect's response is that of its own line to a small pulse, so that no effect needs a separate small-signal model. A
static effect of speed or position (friction, cogging) has no linear model and is left out, like dry friction.

Source: Pintelon & Schoukens, System Identification (2012), 2.2 (response by an impulse).
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from rtctl import machines
from rtctl.config.errors import NoAnswer
from rtctl.design import margins, response
from rtctl.design.margins import Margins
from rtctl.improve.lines import runner
from rtctl.plants.physics import TERMS, ordered

PULSE = 1e-6  # of the signal's unit; small against every limit
QUIET = 40  # substeps without a response, after which the response has ended
LENGTH = 4000  # substeps that a response may last


def of_config(config: Any) -> Margins | None:
    """Margins of a config's loop on the model in its `plant`; the worse one where two drives pull in turn.

    None where the loop gain crosses 1 nowhere.
    """
    found, chain = [], Chain(config)
    for motor in (1, 2):
        parts = response.take(config, motor)
        high = margins.HIGH / parts.dt
        L, forward = margins.loops(parts)
        try:
            f = margins.refined(chain.behind(L), margins.LOW, high)
            found.append(margins.points(f, chain(f) * L(f), chain(f) * forward(f)))
        except NoAnswer:
            return None
    return min(found, key=lambda m: (m.stable, min(m.GM / 6.0, m.PM / 45.0)))


class Chain:
    """Response of the delays and lags between command and drive, and behind the sensor, as a function of frequency."""

    def __init__(self, config: Any):
        machine = machines.build(config)
        self.h = machine.plant_period / machine.substeps
        self.responses = [
            found
            for entry in ordered(config.plant.physics)
            for site in ("command", "reading")
            if TERMS[entry.term].axis == "frequency"
            and (found := pulse_response(entry, site, config.kind, self.h)) is not None
        ]

    def behind(self, L: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
        """Loop gain `L` times these responses."""
        return lambda f: self(f) * L(f)

    def __call__(self, f: np.ndarray) -> np.ndarray:
        total = np.ones(len(f), complex)
        for found in self.responses:
            rows = np.flatnonzero(found)
            total *= np.exp(-2j * np.pi * np.outer(f, rows * self.h)) @ found[rows]
        return total


def pulse_response(entry: Any, site: str, kind: str, h: float) -> np.ndarray | None:
    """Response (n,) of an effect's line at a site to a pulse of one substep of `h` s; None where it has none there."""
    step = runner([entry], site, kind, h)
    if step is None:
        return None
    out = np.zeros(LENGTH)
    step(0.0)
    for k in range(LENGTH):
        out[k] = step(PULSE if k == 0 else 0.0) / PULSE
        if k > QUIET and not np.any(np.abs(out[k - QUIET : k]) > 1e-9):
            break
    return out


def delay(entry: Any, site: str, config: Any) -> float:
    """Mean delay of an effect at the command or at a reading, s; 0 where it has none."""
    if TERMS[entry.term].axis != "frequency":
        return 0.0
    machine = machines.build(config)
    h = machine.plant_period / machine.substeps
    found = pulse_response(entry, site, config.kind, h)
    if found is None or abs(found.sum()) < 0.1:
        return 0.0
    return float(h * (np.arange(len(found)) @ found) / found.sum())
