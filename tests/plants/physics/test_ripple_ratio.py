"""Periodic ratio error at a joint that is described as rigid."""

import machine
import numpy as np
import pytest

PUSH = np.repeat([0.6, -0.6, 0.3], [300, 300, 200])


@pytest.mark.parametrize("end", ["from", "to"])
def test_lead_error_of_a_rigid_nut_displaces_the_table(end):
    turn = {"from": {}, "to": {"turn": 2 * np.pi * 1.6e-3}}[end]
    term = machine.settings("ripple.ratio", "nut", A=5e-5, phi=0.4, end=end, c=4e6, **turn)
    r, none = (machine.run(machine.SCREW, terms, PUSH) for terms in ([term], []))
    angle = r.x[:, 1]
    assert np.ptp(angle) > 2.0
    error = 5e-5 * (np.sin(angle + 0.4) - np.sin(0.4))
    assert r.y[:, 1] - 1.6e-3 * angle == pytest.approx(-error, abs=8e-6)
    assert r.x.shape[1] == none.x.shape[1] + 1  # the table is a separate coordinate
