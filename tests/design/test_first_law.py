"""First law of a described machine: its kind, its margins, and unreachable requirements."""

import fused
import numpy as np
import pytest

from rtctl.config.errors import NoAnswer
from rtctl.config.load import set_path
from rtctl.design import first_law, systems, tune
from rtctl.machines.described_parts import parts_of

LEAST = (6.0, 45.0)


def config(name, **changes):
    return fused.config(f"machines/{name}", **changes)


@pytest.mark.parametrize(("name", "kind"), [
    ("belt", "pd"), ("two-motor", "pd"), ("pendulum", "pi_velocity"), ("spindle", "pi_velocity"),
])  # fmt: skip
def test_first_law_fits_the_machine_and_meets_the_margins(name, kind):
    found = first_law.design(config(name), LEAST)
    assert found.config.law.position.kind == kind == first_law.kind_for(config(name))[0]
    assert found.margins.stable and found.margins.GM >= 6 and found.margins.PM >= 45
    poles = systems.poles(found.config)
    free = 1 if parts_of(found.config).is_speed else 0  # the position of the spindle is not measured
    assert (np.abs(poles) < 1 - 1e-9).sum() == len(poles) - free


def test_requested_bandwidth_is_met():
    found = first_law.design(config("axis"), LEAST, 4.0)
    assert found.crossover == 4.0 and found.margins.f_PM == pytest.approx(4.0, rel=0.02)


def test_machine_without_a_stabilising_law_gets_a_suggestion():
    """An undamped spring between motor and sensor; no law meets the margins at its resonance."""
    bare = config("torsion", law__feedback="encoder2", machine__joints__shaft__damping=1e-7,
                  machine__bodies__disc1__viscous=0.0, machine__bodies__disc2__viscous=0.0)  # fmt: skip
    with pytest.raises(
        NoAnswer, match=r"no PD law from encoder2 to motor is stable.*close the loop on a sensor at disc1"
    ):
        first_law.design(bare, LEAST)


def test_machine_without_a_law_gets_one():
    bare = set_path(config("belt"), "law.position", {"kind": "pd", "gain": 0.0})
    found = tune.tune(bare)
    assert found.before is None and tune.words(found.before) == "no law that moves the machine"
    text = tune.written(found, "tuned")
    assert "# PD: encoder shows a position, and nothing pulls at rest" in text
    assert found.after.GM >= 6 and found.after.PM >= 45
