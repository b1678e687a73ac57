from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.diagnose.case import read_case
from rtctl.diagnose.preflight import band, jumps, motion, preflight, shafts, signed_counts
from rtctl.diagnose.record import check, load_record

SHARED = Path(__file__).parents[2].parent / "shared"
LAW = {"kind": "unknown"}
CASES = {
    "ivu": {
        "plant": "ivu",
        "sample_rate": 500.0,
        "sensors": {"capstan_counts_per_rev": 10000, "reel_counts_per_rev": 209},
        "drive": {"amp_per_volt": [0.2, 0.2], "limit_volt": 10.0, "dac_bits": 12},
    },
    "ldu": {
        "plant": "ldu",
        "sample_rate": 1000.0,
        "sensors": {"encoder_counts_per_rev": 20000, "scale_m_per_count": 5e-7},
        "drive": {"amp_per_volt": [0.1], "limit_volt": 3.0, "dac_bits": 12},
    },
    "axis": {
        "plant": "axis",
        "sample_rate": 1000.0,
        "sensors": {"x_resolution_m": 1e-6},
        "drive": {"newton_per_volt": 35.0, "limit_volt": 10.0},
    },
}
N = 6000


def swing(rate, size):
    t = np.arange(N) / rate
    return t, size * (np.sin(2 * np.pi * 0.4 * t) + 0.3 * np.sin(2 * np.pi * 1.1 * t))


def ivu(capstan=None, u1=None, u2=None):
    t, q = swing(500.0, 25.0)
    q = q if capstan is None else capstan
    path = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(q))))) * 0.0125 * 209 / (2 * np.pi)
    columns = {
        "t": t,
        "ref": q,
        "w": np.zeros(N),
        "u1": np.cos(7 * t) * 3 if u1 is None else u1,
        "u2": np.sin(5 * t) * 3 if u2 is None else u2,
        "capstan_counts": np.floor(q / (2 * np.pi) * 10000),
        "reel1_counts": np.floor(path / 0.038),
        "reel2_counts": np.floor(path / 0.022),
    }
    return record("ivu", columns)


def ldu(turned=None, u=None, scale=True, counts=None):
    t, q = swing(1000.0, 30.0)
    q = q if turned is None else turned
    columns = {"t": t, "ref": q * 0.003, "w": np.zeros(N), "u": np.cos(7 * t) if u is None else u}
    columns["encoder_counts"] = np.floor(q / (2 * np.pi) * 20000) if counts is None else counts
    if scale:
        columns["scale_counts"] = np.floor(q * 0.003 / 5e-7)
    return record("ldu", columns)


def record(kind, columns, **changes):
    case = {**CASES[kind], "controller": LAW, "controller_known": False, "delay_samples": 1.0, **changes}
    return check(columns, read_case(case, "bundle"), "bundle")


def said(found, *words):
    return any(all(word in sentence for word in words) for sentence in found.findings)


def test_a_record_that_shows_everything_leaves_nothing_open():
    assert preflight(ivu()).cannot_test == []
    assert preflight(ldu()).cannot_test == []


def test_a_drive_of_one_sign_hides_dead_band_and_asymmetry_of_that_drive_only():
    found = preflight(ivu(u2=2.0 + np.sin(np.arange(N) / 100)))
    assert found.cannot_test == ["drive.deadband:drive2", "drive.gain_asymmetry:drive2"]
    assert said(found, "u2", "never negative")
    assert found.numbers["drive2"]["positive"] == 1.0


def test_a_drive_of_one_sign_that_comes_to_zero_shows_its_dead_band():
    found = preflight(ivu(u2=np.maximum(0.0, 3 * np.sin(np.arange(N) / 100))))
    assert found.cannot_test == ["drive.gain_asymmetry:drive2"]


def test_a_drive_at_rest_shows_nothing_of_itself():
    found = preflight(ivu(u2=np.full(N, 0.454)))
    assert {"drive.lag:drive2", "drive.saturation:drive2"} <= set(found.cannot_test)
    assert not any(name.endswith("drive1") for name in found.cannot_test)
    assert said(found, "u2 is constant")


def test_saturation_share_and_a_limit_that_is_never_near():
    wanted = 20 * np.cos(np.arange(N) / 50)
    found = preflight(ivu(u1=np.clip(wanted, -10, 10 - 20 / 4096)))
    assert found.numbers["drive1"]["clipped"] == pytest.approx(
        np.mean(np.abs(20 * np.cos(np.arange(N) / 50)) > 10), abs=0.01
    )
    assert said(found, "u1", "clipped at 10 V")
    low = preflight(ivu(u1=0.5 * np.cos(np.arange(N) / 50)))
    assert low.cannot_test == ["drive.saturation:drive1"]


def test_less_than_half_a_turn_hides_what_repeats_each_turn():
    found = preflight(ivu(capstan=swing(500.0, 1.6)[1]))
    assert "ripple.reel:reel1" in found.cannot_test
    assert "ripple.reel:reel2" in found.cannot_test
    assert "ripple.cogging:motor1" in found.cannot_test
    assert "ripple.capstan:capstan" not in found.cannot_test
    assert said(found, "Reel 1", "of a turn only")


def test_one_way_hides_what_a_reversal_shows():
    t = np.arange(N) / 1000.0
    one_way = 40.0 * np.floor(t) / 4 + 10.0 * np.minimum(t % 1.0, 0.8)
    found = preflight(ldu(turned=one_way, u=1.0 + np.cos(7 * t) * 0.99))
    assert "friction.asymmetry:carriage" in found.cannot_test
    assert "transmission.backlash:wheel" in found.cannot_test
    assert "sensor.rectified:encoder" in found.cannot_test
    assert "friction.stribeck:motor" not in found.cannot_test
    both = preflight(ldu(turned=one_way))  # pushed both ways: play opens without a reversal
    assert "transmission.backlash:wheel" not in both.cannot_test


def test_no_standstill_hides_what_happens_at_its_edge():
    t = np.arange(N) / 1000.0
    found = preflight(ldu(turned=20.0 * t + 2 * np.sin(3 * t)))
    assert {"friction.stribeck:carriage", "friction.presliding:carriage"} <= set(found.cannot_test)
    assert not any(name.startswith("friction.viscous") for name in found.cannot_test)
    steady = preflight(ldu(turned=20.0 * t))
    assert "friction.viscous:carriage" in steady.cannot_test


def test_without_a_scale_the_carriage_is_unseen():
    found = preflight(ldu(scale=False))
    assert {"sensor.scale:scale", "guide.thickness:carriage", "guide.thickness:scale"} <= set(found.cannot_test)
    assert said(found, "No scale")


def test_gaps_and_jitter_of_the_clock():
    t, q = swing(1000.0, 0.1)
    columns = {"t": t, "ref": q, "w": 0 * t, "u": np.cos(7 * t), "x": q}
    whole = preflight(record("axis", columns))
    assert whole.numbers["clock"]["gaps"] == 0
    assert whole.numbers["clock"]["jitter"] < 1e-9
    keep = np.delete(np.arange(N), [500, 501, 502, 4000])
    cut = preflight(record("axis", {name: values[keep] for name, values in columns.items()}))
    assert (cut.numbers["clock"]["gaps"], cut.numbers["clock"]["rows_lost"]) == (2, 4)
    assert said(cut, "2 gaps", "4 rows", "row 499")
    shaken = {**columns, "t": t + 1e-4 * np.random.default_rng(1).standard_normal(N)}
    uneven = preflight(record("axis", shaken))
    assert uneven.numbers["clock"]["jitter"] == pytest.approx(0.1 * np.sqrt(2), rel=0.1)
    assert said(uneven, "uneven")


def test_wraps_and_jumps_of_a_counter():
    q = swing(1000.0, 30.0)[1]
    true = np.floor(q / (2 * np.pi) * 20000)
    wrapped = preflight(ldu(counts=true % 65536))
    assert wrapped.numbers["encoder_counts"]["wraps"] > 0
    assert said(wrapped, "encoder_counts wrapped", "16 bits")
    assert wrapped.numbers["encoder_counts"]["jumps"] == []
    lost = true.copy()
    lost[3000:] -= 400
    jumped = preflight(ldu(counts=lost))
    assert jumped.numbers["encoder_counts"]["jumps"] == [3000]
    assert said(jumped, "encoder_counts jumps 1 times", "row 3000")


@settings(deadline=None, max_examples=40)
@given(st.integers(40, 950), st.integers(0, 2**31), st.booleans())
def test_a_jump_is_found_wherever_it_is_and_nothing_else(row, seed, up):
    rng = np.random.default_rng(seed)
    values = np.floor(
        np.cumsum(20 * np.sin(np.arange(1000) / 90 + rng.uniform(0, 6)) + 0.3 * rng.standard_normal(1000))
    )
    assert len(jumps(values, 1.0)) == 0
    values[row:] += 60 if up else -60
    assert jumps(values, 1.0).tolist() == [row]


def test_a_long_tick_is_no_jump():
    ticks = np.full(999, 0.002)
    ticks[500] = 0.004
    t = np.concatenate(([0.0], np.cumsum(ticks)))
    assert len(jumps(3.0 * t, 1e-5)) == 1
    assert len(jumps(3.0 * t, 1e-5, t)) == 0


def test_a_counter_that_cannot_tell_direction_gets_its_sign():
    q = swing(500.0, 25.0)[1]
    guide = np.floor(q / (2 * np.pi) * 10000)
    path = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(q))))) * 8.0
    signed = signed_counts(np.floor(path), guide, 10)
    assert np.abs(signed - 8.0 * q).max() < 12.0
    assert np.array_equal(signed_counts(np.floor(path), 0 * guide, 10), 0 * path)


def test_both_reels_turn_with_the_tape():
    made = ivu()
    capstan, reel1, reel2 = shafts(made)
    q = swing(500.0, 25.0)[1]
    assert np.ptp(capstan.q) == pytest.approx(np.ptp(q), rel=1e-3)
    assert np.corrcoef(reel1.q, q)[0, 1] > 0.999
    assert np.corrcoef(reel2.q, q)[0, 1] < -0.999
    assert motion(made, reel2).turns == pytest.approx(np.ptp(q) * 0.0125 / 0.022 / (2 * np.pi), rel=0.02)
    assert motion(made, reel1).forward == pytest.approx(motion(made, reel2).backward, abs=0.01)


def test_motion_of_a_shaft_that_rests_runs_and_returns():
    t = np.arange(N) / 1000.0
    rest, run, back = 0.0 * t[:2000], 5.0 * (t[2000:5000] - 2.0), 15.0 - 5.0 * (t[5000:] - 5.0)
    made = ldu(turned=np.concatenate((rest, run, back)))
    m = motion(made, shafts(made)[0])
    assert (m.standstill, m.forward, m.backward) == pytest.approx((1 / 3, 1 / 2, 1 / 6), abs=0.01)
    assert m.reversals == 1
    assert m.turns == pytest.approx(15.0 / (2 * np.pi), rel=1e-3)
    assert m.high_speed == pytest.approx(5.0, rel=0.01)


def test_an_axis_that_only_knows_its_speed():
    t = np.arange(N) / 1000.0
    columns = {"t": t, "ref": 0 * t, "w": 0 * t, "u": np.cos(7 * t), "speed": 10 * np.sin(2 * t)}
    made = record("axis", columns, sensors={"unit": "rad", "column": "speed"})
    (carriage,) = shafts(made)
    assert np.ptp(carriage.q) == pytest.approx(10.0, rel=0.01)
    assert "ripple.cogging:carriage" not in preflight(made).cannot_test


def test_band_of_a_signal():
    t = np.arange(20000) / 1000.0
    low, high = band(np.sin(2 * np.pi * 20 * t) + np.sin(2 * np.pi * 60 * t), 1e-3)
    assert low == pytest.approx(20, abs=0.5)
    assert high == pytest.approx(60, abs=0.5)
    assert band(np.ones(100), 1e-3) is None
    assert band(np.full(100, np.nan), 1e-3) is None


def practice(name):
    folder = SHARED / name
    if not folder.is_dir():
        pytest.skip(f"{folder} is missing")
    return preflight(load_record(folder))


@pytest.mark.parametrize("name", [f"case-{k:04d}" for k in range(1, 25)])
def test_practice_cases_have_a_clock_without_gaps_and_counters_without_jumps(name):
    found = practice(f"blind/practice/{name}")
    assert found.numbers["clock"]["gaps"] == 0
    assert found.numbers["law"]["exact"]
    for counter in ("capstan_counts", "reel1_counts", "reel2_counts", "encoder_counts", "scale_counts"):
        assert found.numbers.get(counter, {"jumps": []})["jumps"] == []


def test_the_ball_screw_shows_all_but_its_own_scale():
    found = practice("data/emps")
    assert found.cannot_test == ["sensor.scale:sensor"]
    assert found.numbers["law"]["holds"]
    assert found.numbers["carriage"]["reversals"] >= 5


def test_the_oscillator_is_driven_without_a_loop():
    found = practice("data/silverbox_multisine")
    assert said(found, "no loop")
    assert "law" not in found.numbers


def test_rows_at_uneven_times_are_told_with_what_became_of_them():
    t = np.cumsum(np.random.default_rng(3).uniform(0.7e-3, 1.3e-3, N))
    case = read_case({**CASES["axis"], "sample_rate": None, "controller": LAW}, ".")
    columns = {"t": t, "ref": np.full(N, np.nan), "w": np.zeros(N), "u": np.sin(9 * t), "x": 0.1 * np.sin(t)}
    record = check(columns, case)
    found = preflight(record)
    assert any("The clock is uneven" in finding for finding in found.findings)
    assert any(f"Its {N} rows" in f and f"laid onto {len(record.t)} rows" in f for f in found.findings)
    assert found.numbers["clock"]["rows_even"] == len(record.t)
    assert found.numbers["clock"]["jitter"] > 0.1
