"""Static drive effects: limits, signs, zero size, and location on a machine."""

import numpy as np
import pytest
import stand
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from rtctl.plants.physics import drive

H = 1e-3
volts = st.floats(-10, 10)
forms = st.sampled_from(drive.DEADBAND_FORMS)


def deadband(band: float, form: str = "shift", edge: float = 0.1) -> drive.DeadbandParams:
    return drive.build_deadband(drive.DeadbandSettings(node="drive", band=band, form=form, edge=edge), H)


def saturation(limit: float, knee: float = 0.0, rise: float = 0.0, form: str = "parabola") -> drive.SaturationParams:
    return drive.build_saturation(
        drive.SaturationSettings(node="drive", limit=limit, knee=knee, rise=rise, form=form), H
    )


def memory() -> np.record:
    return np.zeros(1, drive.SATURATION_STATE).view(np.recarray)[0]


@settings(deadline=None)
@given(volts, st.floats(-1, 1))
def test_offset_and_gain_asymmetry_of_the_command(u, a):
    off = drive.build_offset(drive.OffsetSettings(node="drive", offset=a), H)
    assert drive.offset(off, u) == u + a
    lop = drive.build_gain_asymmetry(drive.GainAsymmetrySettings(node="drive", a=0.9 * a), H)
    share = 1 + 0.9 * a if u > 0 else 1 - 0.9 * a
    assert drive.gain_asymmetry(lop, u) == pytest.approx(share * u)


@settings(deadline=None)
@given(volts, st.floats(0, 3), forms, st.floats(0, 1))
def test_dead_band_is_odd_and_sign_preserving_and_vanishes_at_size_zero(u, band, form, edge):
    p = deadband(band, form, edge)
    out = drive.deadband(p, u)
    assert drive.deadband(p, -u) == -out
    assert out * u >= 0.0
    assert drive.deadband(deadband(0.0, form, edge), u) == u
    assert abs(out - u) <= band * (1 + edge) + 1e-12


@pytest.mark.parametrize(("form", "inside", "outside"), [("shift", 0.0, 0.5), ("cut", 0.0, 1.5), ("floor", 1.0, 1.5)])
def test_forms_of_the_dead_band(form, inside, outside):
    p = deadband(1.0, form)
    assert drive.deadband(p, 0.5) == inside
    assert drive.deadband(p, 1.5) == outside
    assert drive.deadband(p, 0.0) == 0.0


def test_edge_of_a_cut_dead_band_is_continuous_and_symmetric():
    p = deadband(1.0, "cut", 0.2)
    out = np.array([drive.deadband(p, u) for u in np.linspace(0.7, 1.3, 601)])
    assert np.diff(out).min() >= 0.0 and np.diff(out).max() < 0.01
    assert drive.deadband(p, 1.0) == pytest.approx(0.5)
    sharp = deadband(1.0, "cut", 0.0)
    assert drive.deadband(sharp, 0.999) == 0.0 and drive.deadband(sharp, 1.0) == 1.0


@settings(deadline=None)
@given(volts, volts, st.floats(0.1, 20), st.floats(0, 0.9), st.sampled_from(["parabola", "rapp"]))
def test_saturation_is_monotone_odd_and_bounded(u, w, limit, knee, form):
    p, s = saturation(limit, knee, form=form), memory()
    one, two = sorted((u, w))
    low, high = drive.saturation(p, s, one), drive.saturation(p, s, two)
    assert low <= high + 1e-12
    assert abs(high) <= limit
    assert drive.saturation(p, s, -u) == -drive.saturation(p, s, u)
    if abs(u) <= limit * (1 - knee) and form == "parabola":
        assert drive.saturation(p, s, u) == u


@pytest.mark.parametrize("knee", [0.02, 0.15, 0.6])
def test_both_saturation_forms_lose_a_quarter_of_the_knee_at_the_limit(knee):
    s = memory()
    forms = [saturation(2.0, knee, form=form) for form in ("parabola", "rapp")]
    assert [drive.saturation(p, s, 2.0) / 2.0 for p in forms] == pytest.approx([1 - knee / 4] * 2, abs=0.04 * knee)
    below, beyond = (1 - 1.05 * knee) * 2.0, (1 + 1.05 * knee) * 2.0
    assert drive.saturation(forms[0], s, below) == below and drive.saturation(forms[0], s, beyond) == 2.0
    assert drive.saturation(forms[1], s, below) < below and drive.saturation(forms[1], s, beyond) < 2.0
    assert drive.saturation(forms[1], s, 1e6) == 2.0 and drive.saturation(forms[1], s, 1e-3) == pytest.approx(1e-3)
    assert drive.saturation(saturation(2.0, 0.0, form="rapp"), s, 3.0) == 2.0  # sharp limit without a knee


def test_rise_limit_outputs_the_mean_over_each_substep():
    p, s = saturation(100.0, rise=0.01), memory()  # 10 ms per volt: 0.1 V per substep
    assert drive.saturation(p, s, 1.0) == pytest.approx(0.05)
    out = [drive.saturation(p, s, 1.0) for _ in range(20)]
    assert out[7] == pytest.approx(0.85) and out[-1] == 1.0
    assert drive.saturation(p, s, 0.95) == pytest.approx(0.95 + 0.5 * 0.05 * 0.5)  # reached after half a substep
    assert drive.saturation(p, s, 0.95) == pytest.approx(0.95)


def sag_state():
    return np.zeros(1, drive.SUPPLY_SAG_STATE).view(np.recarray)[0]


def test_drawn_form_of_supply_sag_is_the_fixed_point_of_the_load():
    """Factor 1 / (1 + k sum|u|), immediately without and finally with a time constant."""
    for tau, steps in ((0.0, 1), (0.02, 2000)):
        p, s = (
            drive.build_supply_sag(drive.SupplySagSettings(node="drive1", k=0.1, form="drawn", tau=tau), H),
            sag_state(),
        )
        for _ in range(steps):
            u = np.array([2.0, -3.0])
            drive.supply_sag(p, s, u, 0)
        assert u == pytest.approx(np.array([2.0, -3.0]) / 1.5)


def test_supply_sag_develops_with_its_time_constant():
    p, s, got = drive.build_supply_sag(drive.SupplySagSettings(node="drive1", k=0.1, tau=0.02), H), sag_state(), []
    for _ in range(100):
        u = np.array([2.0, 0.0])
        drive.supply_sag(p, s, u, 0)
        got.append(u[0])
    t = H * np.arange(1, 101)
    np.testing.assert_allclose(got, 2.0 * (1 - 0.2 * (1 - np.exp(-t / 0.02))), rtol=1e-12)


def test_supply_sag_scales_all_drives_by_the_total_load():
    p = drive.build_supply_sag(drive.SupplySagSettings(node="drive1", k=0.1), H)
    u = np.array([1.0, -2.0])
    drive.supply_sag(p, sag_state(), u, 0)
    assert u == pytest.approx([0.7, -1.4])
    p = drive.build_supply_sag(drive.SupplySagSettings(node="drive1", k=0.1, form="power"), H)
    u = np.array([1.0, -2.0])
    drive.supply_sag(p, sag_state(), u, 0)
    assert u == pytest.approx([0.5, -1.0])
    u = np.array([9.0, 9.0])
    drive.supply_sag(p, sag_state(), u, 0)
    assert list(u) == [0.0, 0.0]  # the factor is limited to zero


def test_load_of_one_motor_lowers_the_supply_of_the_other():
    term = stand.make("drive.supply_sag", "ivu", k=0.05)
    alone, both = np.tile([0.5, 0.5], (200, 1)), np.tile([0.5, 3.0], (200, 1))
    loss = [stand.run("ivu", [term], u).x[-1, 10] / stand.run("ivu", [], u).x[-1, 10] for u in (alone, both)]
    assert loss == pytest.approx([0.95, 0.825], rel=1e-3)  # x[10] is the current of motor 1


@pytest.mark.parametrize(("node", "channel"), [("drive1", 0), ("drive2", 1)])
def test_drive_offset_acts_only_on_its_drive(node, channel):
    u = np.tile([0.5, 0.5], (200, 1))
    change = stand.run("ivu", [stand.make("drive.offset", "ivu", node, offset=0.1)], u).x - stand.run("ivu", [], u).x
    assert change[-1, 10 + 2 * channel] == pytest.approx(0.1 * 0.2, rel=1e-3)  # 0.2 A/V
    assert change[-1, 12 - 2 * channel] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("model", "values"),
    [
        (drive.OffsetSettings, {"offset": np.nan}),
        (drive.DeadbandSettings, {"band": -0.1}),
        (drive.DeadbandSettings, {"band": 0.1, "form": "step"}),
        (drive.GainAsymmetrySettings, {"a": 1.0}),
        (drive.SaturationSettings, {"limit": 0.0}),
        (drive.SaturationSettings, {"limit": 1.0, "rise": -1.0}),
        (drive.SupplySagSettings, {"k": -0.1}),
    ],
)
def test_settings_out_of_bounds_are_refused(model, values):
    with pytest.raises(ValidationError):
        model(node="drive", **values)


def test_separate_supply_sags_only_with_its_own_drive():
    p = drive.build_supply_sag(drive.SupplySagSettings(node="second", k=0.1, feeds="own"), H)
    u = np.array([4.0, -2.0, 1.0])
    drive.supply_sag(p, sag_state(), u, 1)
    assert u == pytest.approx([4.0, -1.6, 1.0])
