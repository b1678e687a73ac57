"""Command between its samples in an open-loop recording: held, or a smooth command that was sampled.

A generator in the laboratory has a filter at its output; a DAC in a loop holds its value. An open-loop recording may
not say which of both wrote the command. A held model of a smooth command is off by half a tick of delay and a small
gain.
"""

from copy import copy

import numpy as np

from rtctl.diagnose.likelihood.fits import Fitted, refit
from rtctl.diagnose.likelihood.joint import Joint
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.model.kernel import TRACK
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.model.space import Space
from rtctl.diagnose.record.hold import half_a_tick_on

CLEARLY = 5.0  # nats of evidence: least gain of the other kind of command


def other_way(like: Likelihood) -> Likelihood | None:
    """Likelihood with the other kind of command between samples; None where a controller held the command."""
    parts = []
    for part in like.parts:
        other = other_commands(part.sim)
        if other is None:
            return None
        parts.append(copy(part))
        parts[-1].sim = other
    return parts[0] if len(parts) == 1 else Joint(parts)


def other_commands(sim: Simulator) -> Simulator | None:
    """Simulator with the other kind of command between samples; None where a controller held the command."""
    if not sim.case.open_loop or sim.mode != TRACK or not sim.volts.size:
        return None
    out = copy(sim)
    held = np.ascontiguousarray(sim.record.u)
    out.volts = np.ascontiguousarray(half_a_tick_on(held)) if np.array_equal(sim.volts, held) else held
    return out


def likelier(like: Likelihood, space: Space) -> Likelihood:
    """Likelihood with the kind of command under which the description alone has the higher evidence."""
    other = other_way(like)
    if other is None or refit(other, space).log_evidence < refit(like, space).log_evidence:
        return like
    return other


def suits(best: Fitted) -> Likelihood | None:
    """Likelihood with the other kind of command, where the evidence of a model gains CLEARLY; else None."""
    other = other_way(best.like)
    if other is None:
        return None
    return other if refit(other, best.space, best.x).log_evidence > best.log_evidence + CLEARLY else None
