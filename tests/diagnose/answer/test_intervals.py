"""Intervals of effect sizes, from the half widths of the fitted unknowns."""

from types import SimpleNamespace

import numpy as np
import pytest
from graph_cases import BELT, blank, case_of, command

from rtctl.diagnose.answer.intervals import sizes
from rtctl.diagnose.model.space import COSINE, INVERSE, SINE, SIZE, Coordinate, Hypothesis, Space

MACHINE = blank(case_of(BELT), command(0.6)).case.machine


def sizes_of(hypothesis, x, half):
    """Sizes of the only effect of a fit at x with half widths `half`."""
    space = Space(None, (), lambda _: 0.0, (hypothesis,))
    fit = SimpleNamespace(
        space=space, x=np.array(x), like=SimpleNamespace(sim=SimpleNamespace(case=SimpleNamespace(machine=MACHINE)))
    )
    return sizes(fit, 0, np.array(half))


def test_interval_of_a_size_is_scaled_to_its_unit():
    rub = Hypothesis("friction.coulomb", "carriage", (Coordinate("F_C", SIZE, 2.0),))
    force = sizes_of(rub, [1.0], [0.1])["F_C"]
    assert (force.value, force.low, force.high, force.unit) == (2.0, 1.8, 2.2, "N")


@pytest.mark.parametrize(
    ("x", "low", "high"), [((3.0, 0.0), 2.0, 4.0), ((0.0, 3.0), 0.0, 7.0), ((3.0, 4.0), 1.74, 8.26)]
)
def test_interval_of_an_amplitude_uses_the_width_along_its_phase(x, low, high):
    pair = (Coordinate("A|phi", COSINE, 1.0), Coordinate("A|phi", SINE, 1.0))
    found = sizes_of(Hypothesis("ripple.cogging", "motor", pair, {"per_turn": 4.0}), x, [1.0, 4.0])["A"]
    assert (found.low, found.high) == pytest.approx((low, high), abs=0.01)


def test_interval_of_a_limit_follows_from_its_inverse():
    limit = Hypothesis("drive.saturation", "amplifier", (Coordinate("limit", INVERSE, 6.0),))
    found = sizes_of(limit, [2.0], [0.5])["limit"]
    assert (found.value, found.low, found.high) == pytest.approx((3.0, 2.4, 4.0))
