import numpy as np
import pytest
from graph_cases import BELT, PENDULUM, RATE, blank, case_of, command, record

from rtctl.diagnose.model.kernel import OPEN
from rtctl.diagnose.model.model import nominal, rigid, settings_of
from rtctl.diagnose.model.simulate import Simulator

FREE = {**PENDULUM, "bodies": {"rod": {"inertia": 9.8e-3, "gravity": {"mass": 0.28, "arm": 0.17, "angle": 0.0}}}}


def test_free_pendulum_has_its_closed_form_period():
    sim = Simulator(blank(case_of(FREE), np.zeros(2000)))
    sim.seen = np.full(2000, 0.05)  # initial position
    angle = sim.run(nominal(sim.case), OPEN)[:, 0]
    crossings = np.flatnonzero((angle[1:] < 0.0) & (angle[:-1] >= 0.0))
    at = crossings + angle[crossings] / (angle[crossings] - angle[crossings + 1])
    period = 2 * np.pi * np.sqrt(9.8e-3 / (0.28 * 9.80665 * 0.17)) * (1 + 0.05**2 / 16)
    np.testing.assert_allclose(np.diff(at) / RATE, period, rtol=1e-4)


def test_friction_stops_a_pendulum():
    sim = Simulator(blank(case_of(PENDULUM), np.zeros(6000)))
    sim.seen = np.full(6000, 0.5)
    angle = sim.run(nominal(sim.case), OPEN)[:, 0]
    assert np.ptp(angle[-500:]) < 1e-6
    assert abs(angle[-1]) < 5e-3 / (0.28 * 9.80665 * 0.17)  # within the band of dry friction


def test_tracking_correction_equals_a_constant_force():
    u = command(4.0)
    shown = record(case_of(PENDULUM), u, push=np.full(len(u), 0.08))
    sim = Simulator(shown)
    _, push = sim.everything(nominal(shown.case))
    np.testing.assert_allclose(np.median(push[500:]), 0.08, rtol=0.03)


def test_tracking_correction_of_the_true_model_is_small():
    u = command(4.0)
    sim = Simulator(record(case_of(PENDULUM), u))
    out, push = sim.everything(nominal(sim.case))
    assert np.abs(np.median(push[200:])) < 1e-3
    assert np.std(out[200:, 0] - sim.seen[200:]) < 1 / 5000.0


def test_released_run_has_no_correction_after_its_row():
    u = command(4.0)
    sim = Simulator(record(case_of(PENDULUM), u, push=np.full(len(u), 0.08))).released(1000)
    out, push = sim.everything(nominal(sim.case))
    assert not push[1000:].any()
    assert np.abs(out[-1, 0] - sim.seen[-1]) > 0.01


def test_divergent_model_gives_nan():
    sim = Simulator(blank(case_of(FREE), np.zeros(500)))
    sim.seen = np.zeros(500)
    sim = sim.pushed(np.full((500, 1), 1e17))
    out = sim.run(nominal(sim.case), OPEN)
    assert np.isnan(out[-1, 0])


def test_command_acts_after_its_delay():
    case = case_of(FREE) | {"delay_samples": 3.0}
    sim = Simulator(blank(case, np.where(np.arange(60) >= 20, 1.0, 0.0)))
    moved = np.flatnonzero(sim.run(nominal(sim.case), OPEN)[:, 0])
    assert moved[0] == 24  # 20 rows before the step, 3 rows of delay, 1 row of response


def test_term_acts_at_its_node():
    u = command(0.6)
    case = case_of(BELT)
    sim = Simulator(blank(case, u))
    model = nominal(sim.case)
    free = sim.run(model, OPEN)
    held = sim.run(model.add(settings_of({"term": "friction.coulomb", "node": "carriage", "F_C": 5.0})), OPEN)
    assert np.ptp(held[:, 1]) < 0.8 * np.ptp(free[:, 1])


def test_rigid_ratios_of_a_belt():
    case = blank(case_of(BELT), np.zeros(100)).case
    assert rigid(case.layout, case.values, "motor") == {"motor": 1.0, "carriage": 0.0127}
    assert rigid(case.layout, case.values, "carriage")["motor"] == pytest.approx(1 / 0.0127)


def test_sticking_body_tracks_a_displacement_without_breaking_away():
    case = case_of(PENDULUM)
    stiff = {**case, "machine": {**PENDULUM, "bodies": {"rod": {"inertia": 9.8e-3, "dry": 0.5}}}}
    made = blank(stiff, np.zeros(1000))
    y = np.where(np.arange(1000) < 300, 0.0, 0.02)  # displaced by hand, at rest below break-away
    sim = Simulator(made._replace(y={"encoder": y}))
    out, push = sim.everything(nominal(made.case))
    assert abs(out[-1, 0] - 0.02) < 1e-4
    rest = np.diff(out[600:, 0])
    assert (np.abs(rest) < 1e-6).all()
    assert abs(push[-1, 0]) < 1e-3
