"""Ratio that repeats every turn, at a joint that is a spring and at one that is said to be rigid."""

import machine
import numpy as np
import pytest

PUSH = np.repeat([0.6, -0.6, 0.3], [300, 300, 200])


@pytest.mark.parametrize("end", ["from", "to"])
def test_a_nut_that_is_rigid_but_for_its_lead_takes_the_table_ahead_and_behind(end):
    turn = {"from": {}, "to": {"turn": 2 * np.pi * 1.6e-3}}[end]
    term = machine.settings("ripple.ratio", "nut", A=5e-5, phi=0.4, end=end, c=4e6, **turn)
    r, none = (machine.run(machine.SCREW, terms, PUSH) for terms in ([term], []))
    angle = r.x[:, 1]
    assert np.ptp(angle) > 2.0
    error = 5e-5 * (np.sin(angle + 0.4) - np.sin(0.4))
    assert r.y[:, 1] - 1.6e-3 * angle == pytest.approx(-error, abs=8e-6)
    assert r.x.shape[1] == none.x.shape[1] + 1  # the table moves by itself
