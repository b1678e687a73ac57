"""What a command did between its samples, where no controller held it: it was held, or sampled from a smooth one.

A generator in the laboratory has a filter behind it, a DAC in a loop holds. Of a recording in open loop nobody may have
written down which. Held for smooth is half a tick of delay and a little of gain.
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

CLEARLY = 5.0  # nats


def other_way(like: Likelihood) -> Likelihood | None:
    """The likelihood with the commands taken the other way between their samples; None where a controller held them."""
    parts = []
    for part in like.parts:
        other = other_commands(part.sim)
        if other is None:
            return None
        parts.append(copy(part))
        parts[-1].sim = other
    return parts[0] if len(parts) == 1 else Joint(parts)


def other_commands(sim: Simulator) -> Simulator | None:
    """The simulator with the commands taken the other way between their samples; None where a controller held them."""
    if not sim.case.open_loop or sim.mode != TRACK or not sim.volts.size:
        return None
    out = copy(sim)
    held = np.ascontiguousarray(sim.record.u)
    out.volts = np.ascontiguousarray(half_a_tick_on(held)) if np.array_equal(sim.volts, held) else held
    return out


def likelier(like: Likelihood, space: Space) -> Likelihood:
    """The way that the description alone follows better."""
    other = other_way(like)
    if other is None or refit(other, space).log_evidence < refit(like, space).log_evidence:
        return like
    return other


def suits(best: Fitted) -> Likelihood | None:
    """The other way, where a model that was found follows the recording clearly better by it."""
    other = other_way(best.like)
    if other is None:
        return None
    return other if refit(other, best.space, best.x).log_evidence > best.log_evidence + CLEARLY else None
