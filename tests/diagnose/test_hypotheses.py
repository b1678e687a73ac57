"""The list of what a record can be asked about: complete, within the terms' own bounds, and of a size that shows."""

import numpy as np
import pytest

from rtctl.diagnose.hypotheses import hinted, hypotheses, starts_of
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.scales import node_scales
from rtctl.diagnose.space import SHAPE
from rtctl.diagnose.yardstick import Measures
from rtctl.plants.physics import TERMS, anywhere, by_kind, met, nodes
from rtctl.plants.physics.search import At, Choice, Turn
from rtctl.plants.physics.sensor import missed_counts

JUMPS = [(0.3, 1e-3), (0.7, 5e-4)]
SEARCH = {name: term.search for name, term in TERMS.items() if term.search and any(s.offered for s in term.stands)}
HINTED = {name for name in SEARCH if hinted(name)}
HINTS = {
    "order": [2.0, 7.0], "wavelength": [0.01, 0.08], "spot": [0.3], "grip:capstan": [0.02, 0.03], "grip:wheel": [0.001],
    "jump:encoder": JUMPS, "jump:scale": JUMPS, "jump:sensor": JUMPS,
}  # fmt: skip


def names(parts):
    out = []
    for part in parts:
        out += [part.amplitude, part.phase] if isinstance(part, Turn) else [part.name]
        out += [part.width] if isinstance(part, At) else []
    return out


@pytest.mark.parametrize("term", SEARCH)
def test_the_search_walks_along_settings_that_the_term_has(term):
    fields = TERMS[term].settings.model_fields
    for name in names((*SEARCH[term], *TERMS[term].richer, *TERMS[term].sliding)):
        assert name in fields, f"{term} has no {name}"
    given = set(names(SEARCH[term]))
    needed = {name for name, info in fields.items() if info.is_required() and name != "node"}
    assert needed <= given


@pytest.mark.parametrize("kind", ["ivu", "ldu", "axis"])
def test_every_one_stands_where_its_term_can_and_all_are_there(moved, kind):
    record, base = moved(kind)
    found = hypotheses(record, base, HINTS)
    for h in found:
        assert h.node in nodes(TERMS[h.term], kind)
    offered = {n: [s for s in t.stands if s.offered] for n, t in TERMS.items()}
    wanted = {name for name in SEARCH if met(offered[name], kind)}
    if kind == "axis":  # this one slides, and it has one sensor, which would have to disagree with itself
        wanted -= {"load.imbalance", "sensor.scale", "sensor.rectified", "guide.dirt"}
    assert wanted == {h.term for h in found}


@pytest.mark.parametrize("kind", ["ivu", "ldu", "axis"])
def test_values_are_finite_and_at_a_typical_size_within_the_settings_own_bounds(moved, kind):
    record, base = moved(kind)
    for h in hypotheses(record, base, HINTS):
        x = h.start()
        x[h.sizes] = 0.5
        for value in h.values(x).values():
            assert np.isfinite(value)
        for c in h.coordinates:
            assert np.isfinite(c.scale)
            assert c.scale > 0.0
            assert c.low < c.high
            assert c.start <= c.high
            if c.name != "z_s":  # less of it than the sensor can show is none: it starts below its bound
                assert c.low <= c.start
        made = h.settings(x)
        again = TERMS[h.term].settings(**made.model_dump())  # checked as what a person writes
        assert again == made
        TERMS[h.term].build(made, 1e-4)


@pytest.mark.parametrize("kind", ["ivu", "ldu", "axis"])
def test_none_is_the_same_as_another(moved, kind):
    record, base = moved(kind)
    seen = [(h.name, h.coordinates, tuple(sorted(h.fixed.items()))) for h in hypotheses(record, base, HINTS)]
    assert len(seen) == len(set(seen))


def test_only_some_may_be_asked_about(moved):
    record, base = moved("axis")
    some = hypotheses(record, base, only=("friction.coulomb", "friction.stribeck"))
    assert [h.name for h in some] == ["friction.coulomb:carriage"] + ["friction.stribeck:carriage"] * 5


def test_starts_of_a_shape_are_shares_of_what_the_node_does(moved):
    record, base = moved("axis")
    speeds = [h.coordinates[1].scale for h in hypotheses(record, base, only=("friction.stribeck",))]
    rms = 0.05 * 2 * np.pi / np.sqrt(2)
    np.testing.assert_allclose(speeds, [x * rms for x in (0.012, 0.035, 0.1, 0.3, 0.9)], rtol=0.05)
    size = hypotheses(record, base, only=("friction.stribeck",))[0].coordinates[0]
    assert size.offset == 20.0


def test_without_hints_nothing_that_needs_one_is_asked(moved):
    record, base = moved("axis")
    asked = {h.term for h in hypotheses(record, base)}
    assert {"sensor.missed_counts", "guide.dirt"} <= HINTED
    assert not asked & HINTED - {"load.bump"}  # which has starts of its own besides


def test_jumps_of_a_sensor_are_one_hypothesis_with_one_size(moved):
    record, base = moved("axis")
    told = {"jump:sensor": [(3.0, -2e-3), (1.0, 1e-3)]}
    (h,) = hypotheses(record, base, told, only=("sensor.missed_counts",))
    assert h.settings([-1.0]).size == pytest.approx(-2e-3)
    before = record.dt
    assert h.fixed == {"at": 3.0 - before, "more": ((1.0 - before, -0.5),), "over": before}


@pytest.mark.parametrize("plant", ["axis", "ivu", "ldu"])
def test_the_tick_that_sees_a_jump_first_sees_all_of_it(moved, plant):
    record, base = moved(plant)
    sensor = nodes(TERMS["sensor.scale"], plant)[0]
    told = {f"jump:{sensor}": [(40 * record.dt, 2e-3), (90 * record.dt, -1e-3)]}
    (h,) = hypotheses(record, base, told, only=("sensor.missed_counts",))
    term = TERMS["sensor.missed_counts"]
    p, s = term.build(h.settings([1.0]), record.dt), np.zeros(1, term.state)[0]
    read = [missed_counts(p, s, 0.0, k * record.dt) for k in (39, 40, 89, 90)]
    assert read == pytest.approx([0.0, 2e-3, 2e-3, 1e-3], abs=1e-12)


def test_a_hint_of_a_node_goes_before_a_hint_for_all(moved):
    record, base = moved("ivu")
    found = hypotheses(record, base, {"order": [3.0], "order:motor1": [5.0, 6.0]}, only=("ripple.cogging",))
    orders = {(h.node, c.scale) for h in found for c in h.coordinates if c.kind == SHAPE}
    assert {("motor1", 5.0), ("motor1", 6.0), ("motor2", 3.0)} <= orders
    assert ("motor1", 3.0) not in orders


def test_places_cover_the_travel_of_the_node_and_spots_are_narrow(moved):
    record, base = moved("axis")
    bumps = hypotheses(record, base, {"spot": [0.3]}, only=("load.bump",))
    starts = {(c.offset, w.scale) for h in bumps for c, w in [h.coordinates[1:]]}
    x = record.y["x"]
    wide = sorted(at for at, width in starts if width > 0.04 * np.ptp(x))
    np.testing.assert_allclose(wide, x.min() + np.ptp(x) * (np.arange(8) + 0.5) / 8, atol=1e-4)
    ((at, width),) = [start for start in starts if start[1] < 0.04 * np.ptp(x)]
    assert at == pytest.approx(x.min() + 0.3 * np.ptp(x), abs=1e-6)
    assert width == pytest.approx(0.012 * np.ptp(x))
    forms = {h.fixed["form"] for h in bumps}
    assert forms == set(next(p.values for p in SEARCH["load.bump"] if isinstance(p, Choice)))


def test_a_spot_is_where_the_node_is_then(moved):
    """Reel 2 turns the other way."""
    record, base = moved("ivu")
    at = {h.node: h.coordinates[1].offset for h in hypotheses(record, base, {"spot": [0.9]}, only=("load.bump",))
          if h.coordinates[2].scale < 0.02 * node_scales(record, base)[h.node].span}  # fmt: skip
    x = record.y["capstan_counts"] * 2 * np.pi / record.case.sensors.capstan_counts_per_rev
    place = x.min() + 0.9 * np.ptp(x)
    assert at["capstan"] == pytest.approx(place)
    assert at["motor2"] == pytest.approx(-place * base["R_c"] / base["R2"])


def test_a_drive_that_turns_may_be_asked_about_turns(blank):
    t = np.arange(2000) / 1000
    record = blank("axis", np.sin(t), 30 * np.sin(t), sensors={"x_counts_per_rev": 4096, "unit": "rad"})
    asked = {h.term for h in hypotheses(record, owner_model(record.case).base, HINTS)}
    assert {"load.imbalance", "ripple.cogging", "ripple.encoder"} <= asked


def test_a_linear_drive_with_one_sensor_is_not_asked_about_its_second(moved):
    record, base = moved("ldu")
    alone = record._replace(y={"encoder_counts": record.y["encoder_counts"]})
    lost = {h.term for h in hypotheses(record, base, HINTS)} - {h.term for h in hypotheses(alone, base, HINTS)}
    assert "sensor.scale" in lost
    assert lost <= {"sensor.scale", "sensor.rectified", "guide.thickness", "guide.dirt"}


@pytest.mark.parametrize(("kind", "node", "term", "most"), [
    ("axis", "carriage", "friction.coulomb", 20.0), ("axis", "carriage", "friction.viscous", 200.0),
    ("ivu", "motor1", "friction.viscous", 0.0), ("ldu", "carriage", "friction.viscous", 0.65),
])  # fmt: skip
def test_less_friction_than_the_base_has_is_no_push(moved, kind, node, term, most):
    record, base = moved(kind)
    (h,) = [h for h in hypotheses(record, base, only=(term,)) if h.node == node]
    c = h.coordinates[0]
    assert c.low * c.scale == pytest.approx(-most, rel=0.3, abs=2e-3 * c.scale)


def test_a_wave_of_a_linear_axis_is_its_screws_or_its_guides_by_its_length(moved):
    """And one that is longer than the travel is none: it would be a spring and a push, or any curve of a reading."""
    record, base = moved("axis")
    waves = {"wavelength": [0.01, 0.02, 0.08, 0.15]}  # 0.02 may be either
    found = hypotheses(record, base, waves, only=("ripple.encoder", "guide.thickness", "ripple.cogging"))
    by = {}
    for h in found:
        by.setdefault(h.term, []).append(h.coordinates[-1].scale)
    assert by == {"ripple.encoder": [0.01, 0.02], "guide.thickness": [0.02, 0.08], "ripple.cogging": [0.01, 0.02, 0.08]}
    assert {h.coordinates[-1].name for h in found} == {"turn", "wavelength"}


def test_the_step_of_a_wave_moves_its_far_end_by_little(moved):
    record, base = moved("axis")
    span = float(np.ptp(record.y["x"]))
    for h in hypotheses(record, base, {"wavelength": [0.001, 0.3]}, only=("ripple.cogging",)):
        c = h.coordinates[-1]
        assert c.step * 2 * np.pi / c.scale * span <= 0.1 * 1.2


@pytest.mark.parametrize(("kind", "term", "name"), [
    ("axis", "guide.thickness", "wavelength"), ("axis", "ripple.cogging", "turn"),
    ("ldu", "guide.thickness", "wavelength"),
])  # fmt: skip
def test_a_wave_comes_once_in_the_travel_at_least(moved, kind, term, name):
    """Of a longer one nothing says that it is a wave: with its harmonics it follows any curve."""
    record, base = moved(kind)
    scales = node_scales(record, base)
    span = scales["carriage"].span
    hints = {"wavelength": [0.3 * span, 0.9 * span, 1.1 * span, 3.0 * span]}
    found = [h for h in hypotheses(record, base, hints, only=(term,)) if h.term == term]
    lengths = [(c.scale, c.scale * np.exp(c.high)) for h in found for c in h.coordinates if c.name == name]
    assert {round(start / span, 2) for start, _ in lengths} == {0.3, 0.9}
    assert max(longest for _, longest in lengths) == pytest.approx(span)


@pytest.mark.parametrize(("k", "least"), [(0.0, 1), (900.0, 2)])
def test_where_a_spring_bends_a_wave_comes_twice(moved, k, least):
    """One would follow what the spring's own law is not."""
    record, base = moved("axis")
    span = node_scales(record, base)["carriage"].span
    found = hypotheses(record, {**base, "k": k}, {"wavelength": [0.45 * span, 0.9 * span]}, only=("ripple.cogging",))
    lengths = [c.scale * np.exp(c.high) for h in found for c in h.coordinates if c.name == "turn"]
    assert max(lengths) == pytest.approx(span / least)


@pytest.mark.parametrize(("k", "places"), [(0.0, 2), (900.0, 1)])
def test_beside_the_owners_spring_another_about_the_middle_would_be_a_push(blank, k, places):
    t = np.arange(2000) / 1000
    record = blank("axis", np.sin(t), 0.05 * (1 - np.cos(t)), parameters={"M": 95.0, "F_v": 200.0, "F_c": 20.0, "k": k})
    found = hypotheses(record, owner_model(record.case).base, only=("load.spring",))
    assert len(found) == places and "x0" not in found[0].fixed


def test_what_comes_once_a_turn_is_no_cogging_of_a_shaft_that_may_be_out_of_balance(moved):
    def orders(kind, *asked):
        found = hypotheses(*moved(kind), {"order": list(asked)}, only=["ripple.cogging"])
        return {round(c.scale) for h in found for c in h.coordinates if c.name == "per_turn"}

    assert orders("ivu", 1.0, 2.0, 7.0) == {2, 7}
    assert orders("ldu", 1.0, 2.0, 7.0) == {1, 2, 7}  # whose motor turns many times while its wheel turns once


@pytest.mark.parametrize("term", ["timing.delay", "drive.lag"])
def test_less_lateness_than_the_owner_s_bandwidth_may_be_off_by_is_no_effect(moved, term):
    record, base = moved("ivu")
    for h in hypotheses(record, base, only=[term]):
        (size,) = h.coordinates
        assert size.slight * size.scale == pytest.approx(0.15 * record.case.drive.late)


@pytest.mark.parametrize("name", [name for name, term in TERMS.items() if not by_kind(term)])
def test_a_term_of_described_machines_has_starts(moved, name):
    """Its measures are there, and its sizes are within its settings' bounds."""
    record, base = moved("axis")
    measures = Measures(record, base, node_scales(record, base), {"order": [6.0]})
    node = anywhere(TERMS[name])["axis"][0] if "axis" in anywhere(TERMS[name]) else "carriage"
    for parts in filter(None, (TERMS[name].search, TERMS[name].sliding, TERMS[name].richer)):
        found = starts_of(name, node, parts, measures)
        assert found
        for h in found:
            x = h.start()
            x[h.sizes] = 0.5
            assert all(np.isfinite(value) for value in h.values(x).values())
    plain = starts_of(name, node, TERMS[name].search, measures)[0]
    x = plain.start()
    x[plain.sizes] = 0.5
    TERMS[name].settings(**plain.settings(x).model_dump())
