import numpy as np
import pytest
from described_machines import ROD, ROTOR, case_of, moved, record, rounded
from marks import full

from rtctl.config.errors import NoAnswer, UserError
from rtctl.diagnose.answer.answer import diagnose_record
from rtctl.diagnose.evidence.diagnosis import NAMED
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator

RATE = 100.0
T = np.arange(1000) / RATE
RNG = np.random.default_rng(0)
TURN = 3.0 * np.sin(2 * np.pi * 0.15 * T) + 0.8 * np.sin(2 * np.pi * 0.41 * T)
SPEED, ACCELERATION = np.gradient(TURN, T), np.gradient(np.gradient(TURN, T), T)
SENSED = {"encoder": {"body": "rotor", "measures": "position", "column": "x", "resolution": 1e-4}}
MEASURED = {**ROTOR, "sensors": SENSED}


def test_static_problem_predicts_the_force():
    machine = {**MEASURED, "bodies": {"rotor": {"inertia": 1e-3, "viscous": 5e-4, "dry": 0.02}}}
    r = record(case_of(machine, RATE, problem="static"), tau=np.zeros(len(T)), x=TURN)
    out = Simulator(r).run(nominal(r.case))
    sim = Simulator(r)
    assert sim.channels == ["motor"]
    force = 1e-3 * ACCELERATION + 5e-4 * SPEED + 0.02 * np.sign(SPEED)
    fast = (np.abs(SPEED) > 0.3) & (T > 0.5) & (T < 9.8)
    np.testing.assert_allclose(out[fast, sim.column("motor")], force[fast], atol=6e-4)


def test_static_problem_finds_the_friction_law():
    noise = 1e-4 * np.random.default_rng(0).standard_normal(len(T))
    tau = 1e-3 * ACCELERATION + 5e-4 * SPEED + 0.02 * np.sign(SPEED) + noise
    d = diagnose_record(record(case_of(MEASURED, RATE, problem="static"), tau=tau, x=rounded(TURN, 1e-4)))
    effects = {(e.name, e.node): e for e in d.effects}
    assert effects["friction.coulomb", "rotor"].parameters["F_C"].value == pytest.approx(0.02, rel=0.05)
    assert d.effects[0].name == "friction.coulomb"
    from rtctl.diagnose.answer.report import html

    assert d.headline in html(d).replace("&#39;", "'")


def test_body_with_a_measured_position_follows_it():
    machine = {
        "bodies": {"arm": {"inertia": 1e-3, "viscous": 1e-3}, "wand": {"inertia": 1e-4}},
        "joints": {"hinge": {"from": "wand", "to": "arm", "stiffness": 0.05}},
        "drives": ROTOR["drives"] | {"motor": {**ROTOR["drives"]["motor"], "body": "arm"}},
        "sensors": {"encoder": {**SENSED["encoder"], "body": "arm"}},
    }
    wand = 0.5 * np.sin(2 * np.pi * 0.9 * T)
    at = iter(np.repeat(wand, 20))  # held over a row of the record
    x = moved(np.zeros(len(T)), RATE, 1e-3, lambda x, v: 0.05 * (next(at) - x) - 1e-3 * v)
    case = case_of(machine, RATE, inputs={"wand": {"body": "wand", "column": "alpha", "measures": "position"}},
                   problem="driven")  # fmt: skip
    r = record(case, tau=1e-9 * np.arange(len(T)), x=x, alpha=wand)
    sim = Simulator(r)
    from rtctl.diagnose.model.kernel import OPEN

    out = sim.run(nominal(r.case), mode=OPEN)
    np.testing.assert_allclose(out[:, 0], x, atol=0.02 * np.ptp(x))


def test_measured_input_at_the_predicted_body_is_refused():
    case = case_of(MEASURED, RATE, inputs={"wand": {"body": "rotor", "column": "alpha", "measures": "position"}})
    with pytest.raises(UserError, match=r"inputs.wand.body: .* moves with the body of sensor encoder"):
        record(case, tau=TURN, x=TURN, alpha=TURN)


def test_static_problem_without_a_force_is_refused():
    machine = {"bodies": MEASURED["bodies"], "sensors": SENSED}
    with pytest.raises(NoAnswer, match="a static problem needs a measured force"):
        record(case_of(machine, RATE, problem="static"), x=TURN)


def swing(viscous=3e-4, dry=0.0, cubic=0.0):
    """Positions of a free pendulum released at 1.2 rad and 2 rad/s; the integration error is below the resolution."""
    force = lambda x, v: -viscous * v - 0.15 * 0.15 * 9.80665 * np.sin(x) - cubic * x**3  # noqa: E731
    return rounded(moved(np.zeros(800), 100.0, 3.3e-3, force, dry, x=1.2, v=2.0, finer=500), 1e-5)


def test_initial_position_and_speed_of_a_free_response_are_estimated():
    d = diagnose_record(record(case_of(ROD, 100.0, problem="free"), x=swing(dry=2e-3)))
    assert d.verdict == NAMED
    assert [(e.name, e.node) for e in d.effects] == [("friction.coulomb", "rod")]
    assert d.parameters["start.position"].value == pytest.approx(1.2, abs=0.02)
    assert d.parameters["start.speed"].value == pytest.approx(2.0, abs=0.1)


@full
def test_pendulum_described_as_a_spring_gets_a_softening_or_gravity():
    spring = {"bodies": {"rod": {"inertia": 3.3e-3, "viscous": 3e-4}}, "sensors": ROD["sensors"],
              "joints": {"k": {"from": "frame", "to": "rod", "stiffness": 0.2206}}}  # fmt: skip
    d = diagnose_record(record(case_of(spring, 100.0, problem="free"), x=swing()))
    names = {(e.name, e.node) for e in d.effects if e.confidence > 0.9}
    assert names & {("structure.stiffening", "k"), ("load.gravity", "rod")}


def test_rows_of_a_friction_reversal_are_excluded_from_a_static_problem():
    r = record(case_of(MEASURED, RATE, problem="static"), tau=1e-3 * ACCELERATION, x=rounded(TURN, 1e-4))
    (present,) = Likelihood(Simulator(r)).present
    begin, _ = Likelihood(Simulator(r)).rows
    turns = np.flatnonzero(np.diff(np.sign(SPEED[begin:])))
    assert 5 <= len(turns) == (len(T) - begin - len(present)) / 2
    assert not np.isin(turns, present).any()
