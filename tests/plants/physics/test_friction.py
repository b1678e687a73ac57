"""Friction terms: limits, signs, dissipation, documentation for the mechanic."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from rtctl.idiom import tick
from rtctl.plants import axis, linear
from rtctl.plants.graph import plant as graph
from rtctl.plants.physics import friction

FORMS = ("gaussian", "exponential", "tustin")
H = 1e-3
F_C = 20.4  # of the axis, N


def stribeck(F_s: float = 3.0, v_s: float = 0.5, form: str = "gaussian") -> friction.StribeckParams:
    return friction.build_stribeck(friction.StribeckSettings(node="carriage", F_s=F_s, v_s=v_s, form=form), H)


def coulomb(F_C: float) -> friction.CoulombParams:
    return friction.build_coulomb(friction.CoulombSettings(node="carriage", F_C=F_C), H)


def viscous(B: float) -> friction.ViscousParams:
    return friction.build_viscous(friction.ViscousSettings(node="carriage", B=B), H)


@pytest.mark.parametrize(("form", "share"), [("gaussian", 1 / math.e), ("exponential", 1 / math.e), ("tustin", 0.5)])
def test_stribeck_curve_falls_by_its_form(form, share):
    p = stribeck(form=form)
    assert friction.stribeck(p, 2.0, 0.0) == pytest.approx(1.0)  # F_s at rest less the base
    assert friction.stribeck(p, 2.0, 0.5) == pytest.approx(share)
    assert friction.stribeck(p, 2.0, -0.5) == pytest.approx(share)
    assert friction.stribeck(p, 2.0, 500.0) == pytest.approx(0.0, abs=2e-6)


@settings(deadline=None)
@given(st.sampled_from(FORMS), st.floats(0, 10), st.floats(0, 10), st.floats(-100, 100), st.floats(-100, 100))
def test_stribeck_force_lies_between_static_and_base_level_and_decays_with_speed(form, F_s, base, v, w):
    p = stribeck(F_s=F_s, form=form)
    total = base + friction.stribeck(p, base, v)
    assert min(F_s, base) - 1e-9 <= total <= max(F_s, base) + 1e-9
    slow, fast = sorted((abs(v), abs(w)))
    assert abs(friction.stribeck(p, base, fast)) <= abs(friction.stribeck(p, base, slow)) + 1e-12


@settings(deadline=None)
@given(st.floats(0, 1e3), st.floats(-1e3, 1e3))
def test_viscous_friction_is_proportional_and_opposes_motion(B, v):
    force = friction.viscous(viscous(B), v)
    assert force == -B * v
    assert force * v <= 0.0


def test_coulomb_term_adds_to_the_friction_limit():
    assert friction.coulomb(coulomb(0.3)) == 0.3


@pytest.mark.parametrize("F", [-F_C, -2 * F_C])
def test_negative_total_dry_friction_is_limited_to_zero(F):
    s = plant()
    s.m.x[1] = s.m.v_before[0] = 0.1
    free_run(s, coulomb(F), viscous(-203.5), stribeck(F_s=F_C, v_s=0.01), 1000)
    assert s.m.x[1] == pytest.approx(0.1, rel=1e-6)  # no braking and no driving force


@pytest.mark.parametrize(
    ("model", "values"),
    [
        (friction.ViscousSettings, {"B": math.inf}),
        (friction.StribeckSettings, {"F_s": -1.0, "v_s": 1.0}),
        (friction.StribeckSettings, {"F_s": 1.0, "v_s": 0.0}),
        (friction.StribeckSettings, {"F_s": 1.0, "v_s": 1.0, "form": "gauss"}),
        (friction.CoulombSettings, {"F_C": math.nan}),
    ],
)
def test_invalid_settings_are_refused(model, values):
    with pytest.raises(ValidationError):
        model(node="carriage", **values)


@tick
def substep(s, dry, brake, stick):
    """Substep of the axis with all three terms, as in a generated plant; sizes of zero switch a term off."""
    linear.midpoint(s.m)
    s.m.dry[0] += friction.coulomb(dry)
    s.m.f[0] += friction.viscous(brake, s.m.vm[0])
    s.m.dry[0] += friction.stribeck(stick, s.m.dry_base[0], s.m.vm[0])
    linear.advance(s.m)


@tick
def free_run(s, dry, brake, stick, n):
    for _ in range(n):
        substep(s, dry, brake, stick)


@tick
def closed_run(s, dry, brake, stick, ref, out):
    """A position and speed loop on an encoder of 1 um; counts into `out`."""
    was = 0.0
    for k in range(ref.shape[0]):
        x = math.floor(s.m.x[0] * 1e6) * 1e-6
        s.m.u[0] = min(max(39e3 * (ref[k] - x) - 243.0 * (x - was) / 1e-3, -10.0), 10.0)
        was = x
        substep(s, dry, brake, stick)
        out[k] = math.floor(s.m.x[0] * 1e6)


def plant() -> Any:
    p = axis.build(axis.AxisSettings(), H)
    s = np.zeros(1, axis.AXIS_STATE).view(np.recarray)[0]
    graph.start(p.graph, s)
    return s


NOTHING = {"dry": coulomb(0.0), "brake": viscous(0.0), "stick": stribeck(F_s=F_C, v_s=0.01)}


@settings(deadline=None, max_examples=40)
@given(
    st.floats(-1, 1),
    st.floats(-30, 100),
    st.floats(0, 500),
    st.floats(0, 60),
    st.floats(1e-3, 1),
    st.sampled_from(FORMS),
)
def test_friction_never_accelerates_a_free_axis(v, F, B, F_s, v_s, form):
    s = plant()
    s.m.x[1] = s.m.v_before[0] = v
    speed = abs(v)
    for _ in range(30):
        free_run(s, coulomb(F), viscous(B), stribeck(F_s, v_s, form), 10)
        assert abs(s.m.x[1]) <= speed * (1 + 1e-12)
        assert s.m.x[1] * v >= -1e-9  # no reversal
        speed = abs(s.m.x[1])


def recording(**terms: Any) -> np.ndarray:
    t = np.arange(3000) * 1e-3
    ref = 0.05 * np.clip(t, 0, 1) - 0.05 * np.clip(t - 1.5, 0, 1)
    out = np.zeros(len(t))
    chosen = {**NOTHING, **terms}
    closed_run(plant(), chosen["dry"], chosen["brake"], chosen["stick"], ref, out)
    return out


@pytest.mark.parametrize(
    "term",
    [
        {"dry": coulomb(0.1 * F_C)},
        {"brake": viscous(20.0)},
        *({"stick": stribeck(1.5 * F_C, 0.01, form)} for form in FORMS),
    ],
)
def test_friction_of_typical_size_is_visible_in_a_closed_loop(term):
    base = recording()
    assert 49_000 < base.max() < 51_000  # the loop works
    assert np.abs(recording(**term) - base).max() > 1


def test_forms_of_stribeck_differ_in_a_closed_loop():
    traces = [recording(stick=stribeck(1.5 * F_C, 0.01, form)) for form in FORMS]
    assert np.abs(traces[0] - traces[1]).max() > 1
    assert np.abs(traces[0] - traces[2]).max() > 1
