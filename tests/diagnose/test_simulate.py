"""Simulations against the plant's own equations stepped by hand, closed forms, and the emulator."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import cont2discrete

from rtctl.config.errors import UserError
from rtctl.diagnose.case import read_case
from rtctl.diagnose.kernel import CLOSED, OPEN, SLOTS, TRACK
from rtctl.diagnose.model import owner_model, plant_params
from rtctl.diagnose.record import Record
from rtctl.diagnose.simulate import Simulator, channels, per_unit, resolution, rigid_gain
from rtctl.idiom import tick
from rtctl.plants import axis, linear
from rtctl.plants.graph import plant as graph
from rtctl.plants.physics import TERMS


def term(name, node, **values):
    return TERMS[name].settings(term=name, node=node, **values)


@tick
def by_hand(p, s, volts, substeps, late, x):
    """The axis under held volts that come `late` substeps late."""
    graph.start(p.graph, s)
    for k in range(len(volts)):
        graph.read(p.graph, s.m)
        x[k] = s.m.y[0]
        for i in range(substeps):
            s.m.u[0] = volts[max((k * substeps + i - late) // substeps, 0)]
            linear.midpoint(s.m)
            linear.advance(s.m)


def stepped(volts, substeps=4, late=0, dt=1e-3, **parameters):
    p = axis.build(axis.AxisSettings(parameters=parameters), dt / substeps)
    x = np.zeros(len(volts))
    by_hand(p, np.zeros(1, axis.AXIS_STATE)[0], np.ascontiguousarray(volts, float), substeps, late, x)
    return x


def noise(n, seed=0, size=3.0):
    """Volts (n,) that start with nothing."""
    volts = size * np.repeat(np.random.default_rng(seed).standard_normal(n // 5 + 1), 5)[:n]
    volts[:10] = 0.0
    return volts


def free_run(volts, **parameters):
    """Of an axis with these parameters, m (n,)."""
    case = read_case(
        {"plant": "axis", "sample_rate": 1e3, "parameters": {"M": 1.0}, "drive": {"newton_per_volt": 35.0}}, "."
    )
    n, zero = len(volts), np.zeros(len(volts))
    record = Record("axis", case, np.arange(n) * 1e-3, 1e-3, zero, zero, volts[:, None], {"x": zero}, {})
    return Simulator(record).run(owner_model(case).change(**parameters), OPEN)[:, 0]


def nothing_or(most):
    """None of it, or as much as a machine has."""
    return st.one_of(st.just(0.0), st.floats(1e-3, most))


def test_without_terms_a_free_run_is_the_plants_own_equations_to_the_bit(blank):
    record = blank("axis", noise(1500))
    sim = Simulator(record)
    model = owner_model(record.case)
    base = {k: model.base[k] for k in ("M", "K", "F_v", "F_c", "k")}
    np.testing.assert_array_equal(sim.run(model, OPEN)[:, 0], stepped(record.u[:, 0], sim.substeps, **base))


@settings(deadline=None, max_examples=10)
@given(st.floats(0.5, 200.0), nothing_or(500.0), nothing_or(5e4), st.integers(0, 100))
def test_a_linear_axis_is_exact_at_every_tick(M, F_v, k, seed):
    volts = noise(300, seed)
    A, B = np.array([[0, 1], [-k / M, -F_v / M]]), np.array([[0], [35.0 / M]])
    Phi, Gamma, *_ = cont2discrete((A, B, np.eye(2), np.zeros((2, 1))), 1e-3)
    wanted, x = np.zeros(300), np.zeros(2)
    for n in range(300):
        wanted[n] = x[0]
        x = Phi @ x + Gamma[:, 0] * volts[n]
    got = free_run(volts, M=M, F_v=F_v, k=k, F_c=0.0)
    np.testing.assert_allclose(got, wanted, rtol=1e-9, atol=1e-9 * (np.abs(wanted).max() + 1e-12))


@pytest.mark.parametrize("late", [0.0, 0.25, 0.5, 1.0, 2.75])
def test_a_delay_of_any_part_of_a_tick_holds_the_volts_back(blank, late):
    record = blank("axis", noise(500), delay_samples=late)
    sim = Simulator(record)
    model = owner_model(record.case)
    base = {k: model.base[k] for k in ("M", "K", "F_v", "F_c", "k")}
    wanted = stepped(record.u[:, 0], sim.substeps, round(late * sim.substeps), **base)
    np.testing.assert_array_equal(sim.run(model, OPEN)[:, 0], wanted)


@pytest.mark.parametrize("late", [0.25, 0.6, 1.0, 2.45])
def test_more_delay_as_a_term_is_the_same_as_more_delay_of_the_loop(blank, late):
    """Of a part of a substep too: against steps short enough to hold it whole."""
    volts = noise(600)
    record = blank("axis", volts)
    model = owner_model(record.case).change(F_c=0.0)
    out = Simulator(record).run(model.add(term("timing.delay", "loop", extra=late * 1e-3)), OPEN)[:, 0]
    loop = Simulator(blank("axis", volts, delay_samples=late))
    fine = loop.finer(5).run(model, OPEN)[:, 0]
    np.testing.assert_allclose(out, fine, rtol=0, atol=1e-5 * np.ptp(fine))
    np.testing.assert_allclose(loop.run(model, OPEN)[:, 0], fine, rtol=0, atol=1e-5 * np.ptp(fine))
    off = Simulator(blank("axis", volts, delay_samples=late + 0.05)).finer(5).run(model, OPEN)[:, 0]
    assert np.abs(out - fine).max() < 0.1 * np.abs(off - fine).max()


def test_a_closed_loop_repeats_its_recording_and_its_volts_do_too_in_a_free_run(make_axis):
    made = make_axis(M=100.0)
    out, volts, _ = made.sim.everything(made.model, CLOSED)
    np.testing.assert_array_equal(out[:, 0], made.uncut)
    np.testing.assert_array_equal(volts, made.record.u)
    np.testing.assert_array_equal(made.sim.run(made.model, OPEN)[:, 0], made.uncut)


def test_a_correction_keeps_a_wrong_model_near_the_track_where_a_free_run_drifts_off(plain):
    wrong = owner_model(plain.record.case).change(M=115.0, F_v=150.0)
    free, kept = (plain.sim.run(wrong, mode)[:, 0] - plain.record.y["x"] for mode in (OPEN, TRACK))
    assert np.abs(kept).max() < 5e-4 < 0.1 * np.abs(free).max()


def test_a_machine_that_falls_over_by_itself_stays_on_track(make_axis):
    """A spring that pushes away: of a free run with a slightly wrong model nothing is left after seconds."""
    made = make_axis(k=-1500.0, F_c=2.0)
    near = made.model.change(M=1.02 * made.model.base["M"])
    free = made.sim.run(near, OPEN)[:, 0]
    kept, _, push = made.sim.everything(near, TRACK)
    assert not np.abs(free - made.uncut).max() < 1.0
    assert np.abs(kept[:, 0] - made.uncut).max() < 1e-3
    assert np.isfinite(push).all()


def test_the_true_model_needs_no_correction(make_axis, plain):
    uncut = make_axis(step=0.0, M=100.0, F_v=180.0, F_c=22.0)
    out, _, push = uncut.sim.everything(uncut.model, TRACK)
    assert np.abs(push).max() < 1e-9
    np.testing.assert_allclose(out[:, 0], uncut.uncut, rtol=0, atol=1e-12)
    _, _, push = plain.sim.everything(plain.model, TRACK)  # of readings in steps it needs what half a step asks for
    _, _, wrong = plain.sim.everything(owner_model(plain.record.case), TRACK)
    assert np.sqrt(np.mean(push**2)) < 0.3 * np.sqrt(np.mean(wrong**2))


def test_where_a_model_runs_away_the_rest_is_nan(blank):
    record = blank("axis", noise(2000))
    out = Simulator(record).run(owner_model(record.case).change(k=-1e7, F_c=0.0), OPEN)[:, 0]
    first = int(np.argmax(~np.isfinite(out)))
    assert 10 < first < 2000
    assert np.isnan(out[first:]).all()


def test_as_many_terms_as_there_are_slots_all_act_and_one_more_is_refused(blank):
    record = blank("axis", noise(200))
    many = [term("load.spring", "axis", k=1.0)] * SLOTS
    one = owner_model(record.case)._replace(terms=[term("load.spring", "axis", k=float(SLOTS))])
    sim = Simulator(record)
    both = [sim.run(m, OPEN) for m in (one, one._replace(terms=many))]
    np.testing.assert_allclose(both[1], both[0], rtol=1e-9)
    with pytest.raises(UserError, match=f"{SLOTS + 1} terms; {SLOTS} is the most"):
        sim.run(one._replace(terms=[*many, many[0]]))


def test_shorter_steps_change_next_to_nothing(plain):
    full = TERMS["friction.stribeck"].settings(node="carriage", F_s=40.0, v_s=0.05)
    model = plain.model.add(full)
    coarse, fine = (Simulator(plain.record).finer(f).run(model, TRACK)[:, 0] for f in (1, 4))
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 0.25 * resolution(plain.record)


def test_runs_side_by_side_do_not_touch_each_other(plain):
    models = [plain.model.change(M=m) for m in (90.0, 100.0, 110.0, 120.0)]
    one = [plain.sim.run(m, TRACK) for m in models]
    with ThreadPoolExecutor(2) as pool:
        two = list(pool.map(lambda m: plain.sim.run(m, TRACK), models))
    np.testing.assert_array_equal(one, two)


def test_a_stretch_of_a_recording_is_the_beginning_of_the_whole(plain):
    whole, part = plain.sim.run(plain.model, TRACK), plain.sim.run(plain.model, TRACK, 700)
    assert part.shape == (700, 1)
    np.testing.assert_array_equal(part, whole[:700])


def test_a_term_in_a_slot_is_the_same_term_in_the_emulator(bench, config, blank):
    """The emulator of `rtctl run`, in fused mode, driven by its own law; its volts replayed here."""
    physics = [
        {"term": "drive.offset", "node": "drive", "offset": 0.1},
        {"term": "friction.asymmetry", "node": "carriage", "a": 0.25},
    ]
    reference = {"knots": [(0.0, 0.0), (0.3, 0.02), (0.6, 0.02), (0.9, -0.01), (1.2, 0.0)]}
    settings = config("axis", set={"plant.physics": physics, "plant.substep": 2.5e-4, "reference": reference})
    rows = bench(settings).ask("arm", "play").run(1.5)
    base = settings.plant.parameters.model_dump()
    record = blank("axis", rows["u"].copy(), delay_samples=1.0)
    without = owner_model(record.case).change(**base)
    model = without.add(*(TERMS[p["term"]].settings(**p) for p in physics))
    off, far = (np.abs(rows["truth_x"] - Simulator(record).run(m, OPEN)[:, 0]).max() for m in (model, without))
    assert np.ptp(rows["truth_x"]) > 0.01
    assert off < 1e-6 < 1e-3 < far  # the board's output settles within 3 us, which is all that is left


def test_the_gain_of_a_stiff_machine_is_force_by_mass(blank):
    case = blank("axis", np.zeros(10)).case
    assert rigid_gain(plant_params(owner_model(case), case, 1e-3), "axis") == pytest.approx(35.0 / 95.0)
    case = blank("ldu", np.zeros(10)).case
    model = owner_model(case)
    b = model.base
    J = b["J_m"] * b["N"] ** 2 + b["J_t"] + b["J_c"] + b["J_e"] + b["M"] * b["R_c"] ** 2
    wanted = b["K_m1"] * b["N"] / J
    drag = plant_params(model.change(B_m=0.0, B_c=0.0, K_m2=0.0), case, 1e-4)
    assert rigid_gain(drag, "ldu") == pytest.approx(wanted, rel=1e-3)
    case = blank("ivu", np.zeros((10, 2))).case
    model = owner_model(case)
    b = model.base
    J = (b["J_m1"] + b["J_1"]) * (b["R_c"] / b["R1"]) ** 2 + (b["J_m2"] + b["J_2"]) * (b["R_c"] / b["R2"]) ** 2
    torque = 0.5 * 0.2 * (b["K_m1"] * b["R_c"] / b["R1"] + b["K_m2"] * b["R_c"] / b["R2"])
    assert rigid_gain(plant_params(model, case, 1e-3), "ivu") == pytest.approx(torque / (J + b["J_c"]), rel=1e-2)


def test_readings_stand_in_the_order_of_the_plants_sensors(blank):
    both = blank("ldu", np.zeros(10))
    assert channels(both) == ("encoder_counts", "scale_counts")
    alone = both._replace(y={"encoder_counts": both.y["encoder_counts"]})
    assert channels(alone) == ("encoder_counts",)
    assert channels(blank("ivu", np.zeros((10, 2))))[0] == "capstan_counts"
    assert channels(blank("axis", np.zeros(10))) == ("x",)
    np.testing.assert_allclose(per_unit(both.case), [20000 / (2 * np.pi), 2e6])


def test_resolution_is_what_the_owner_says_or_the_smallest_step_that_occurs(blank, plain):
    assert resolution(plain.record) == 2e-6
    steps = np.cumsum(np.random.default_rng(1).integers(-3, 4, 500)) * 4e-6
    unsaid = blank("axis", np.zeros(500), steps, sensors={})
    assert resolution(unsaid) == pytest.approx(4e-6)
    assert resolution(blank("ivu", np.zeros((10, 2)))) == pytest.approx(2 * np.pi / 10000)
