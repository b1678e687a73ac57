import pytest

from rtctl.laws import map_feedforward


def of(**more):
    settings = map_feedforward.MapFeedforwardSettings(span=4.0, values=[0.0, 1.0, 4.0, 2.0], **more)
    return map_feedforward.build(settings, 0.001)


@pytest.mark.parametrize(("x", "u"), [(0.0, 0.0), (1.5, 2.5), (3.0, 2.0), (3.5, 1.0), (5.5, 2.5), (-0.5, 1.0)])
def test_periodic_map_repeats(x, u):
    assert map_feedforward.step(of(), x, 0.0) == pytest.approx(u)


@pytest.mark.parametrize(("x", "u"), [(10.0, 0.0), (10.0 + 2 / 3, 0.5), (14.0, 2.0), (99.0, 2.0), (-99.0, 0.0)])
def test_non_periodic_map_is_held_beyond_its_ends(x, u):
    assert map_feedforward.step(of(periodic=False, start=10.0), x, 0.0) == pytest.approx(u)


def test_map_is_read_ahead_by_lead_times_speed():
    p = of(lead=0.01)
    assert map_feedforward.step(p, 1.0, 50.0) == pytest.approx(map_feedforward.step(p, 1.5, 0.0))
