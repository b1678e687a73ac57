"""Diagnosis of a Furuta pendulum with a concealed effect, simulated by scipy."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coupled_machines import data_of
from graph_cases import case_of, command
from scipy.integrate import solve_ivp

from rtctl.case.format2 import read_case
from rtctl.diagnose.answer.answer import diagnose_record
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.recording import record_of
from rtctl.diagnose.model.simulate import Simulator

DT, SECONDS = 2e-3, 6.0
M, R_ARM, D, J_ARM, J_ROD, K, OHM = 0.024, 0.085, 0.0645, 1.2e-4, 3.33e-5, 0.042, 8.4
CREEP = 2e-3  # rad/s, width of the smoothed dry friction of the recording


def recorded(more: float, u: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of a Furuta pendulum with the extra dry friction `more` (Nm) of the joint, integrated by scipy."""
    J = J_ROD + M * D * D

    def rates(t: float, z: np.ndarray) -> Any:
        a, v, w = z[1], z[2], z[3]
        s, c = np.sin(a), np.cos(a)
        volts = u[min(max(int(t / DT) - 1, 0), len(u) - 1)]
        on_arm = K * (volts - K * v) / OHM - 5e-6 * v - 1e-3 * np.tanh(v / CREEP)
        on_rod = -5e-6 * w - (2e-5 + more) * np.tanh(w / CREEP)
        one = on_arm - 2 * J * s * c * v * w + M * R_ARM * D * s * w * w
        two = on_rod + J * s * c * v * v - M * 9.80665 * D * s
        m11, m12 = J_ARM + M * R_ARM**2 + J * s * s, M * R_ARM * D * c
        det = m11 * J - m12 * m12
        return [v, w, (J * one - m12 * two) / det, (m11 * two - m12 * one) / det]

    t = np.arange(len(u)) * DT
    z = solve_ivp(rates, (0.0, t[-1]), np.zeros(4), rtol=1e-6, atol=1e-8, max_step=DT, t_eval=t).y
    counts = np.floor(z[:2] * 2048 / (2 * np.pi))
    return {"t": t, "u": u, "arm_counts": counts[0], "pendulum_counts": counts[1]}


@pytest.fixture(scope="module")
def case():
    return case_of(data_of("furuta"))


@pytest.fixture(scope="module")
def columns():
    return recorded(4e-4, command(4.0, SECONDS))


def test_every_independent_body_is_tracked(case, columns):
    sim = Simulator(record_of(columns, read_case(case, Path("bundle")), Path("bundle")))
    assert [one.body for one in sim.followed] == ["arm", "pendulum"]
    assert sim.case.values["start.pendulum"] == 1.0 and "start.arm" not in sim.case.values
    _, push = sim.everything(nominal(sim.case))
    assert push.shape == (len(columns["t"]), 2)


@pytest.mark.long
def test_joint_friction_is_named_at_the_pendulum(case, columns):
    found = diagnose_record(record_of(columns, read_case(case, Path("bundle")), Path("bundle")))
    assert [(e.name, e.node) for e in found.effects] == [("friction.coulomb", "pendulum")]
    assert found.effects[0].parameters["F_C"].value == pytest.approx(4e-4, rel=0.25)
