"""Small machines of the proof: short setups of every topology and descriptions for analytic checks."""

import numpy as np
import pytest

from rtctl.proof.machines import TOPOLOGIES, build, describe, solver
from rtctl.proof.machines import simulate as sim
from rtctl.proof.machines.arrays import NB, ND, NJ, NS
from rtctl.proof.machines.law import law_record


def shorten(s, seconds, settle=0.5):
    n = int(seconds / s.Ts)
    s.ref, s.w, s.settle = s.ref[:n], s.w[:n], int(settle / s.Ts)
    return s


@pytest.fixture(scope="session")
def machines():
    """One nominal machine of each topology with a stable loop, with its run."""
    out = {}
    for k, name in enumerate(TOPOLOGIES):
        for again in range(8):
            s = shorten(build.sound(name, np.random.default_rng([3, k, again]), "rich", frozenset(), False), 1.6)
            run = sim.simulate(s, [1])
            if sim.healthy(s, run):
                out[name] = s, run
                break
    return out


@pytest.fixture(scope="session")
def free():
    """Function (description, command, start, ticks) -> states (n, 2 NB) at 1 kHz of a machine without a law."""

    def run(machine, command, start, n, hold=lambda m: None):
        m = describe.record({"drives": {}, "sensors": {}, "joints": {}} | machine, 1e-3, 1.0)
        hold(m)
        nothing = np.zeros((n, NB))
        states, zero = np.zeros((n, 2 * NB)), np.zeros(n)
        played = np.zeros((n, ND))
        played[:, 0] = command
        first = np.zeros(2 * NB)
        first[: len(start)] = start
        rows = solver.run(
            m[()], law_record(tau=1.0, Ts=1e-3)[()], first, 0, zero, zero, played, nothing, nothing, np.zeros((n, NS)),
            np.zeros((n, NS)), np.zeros((n, NS)), np.zeros((n, NS)), np.zeros((n, ND)), states, np.zeros((n, NJ)),
            np.zeros((n, ND)),
        )  # fmt: skip
        assert rows == n
        return states

    return run
