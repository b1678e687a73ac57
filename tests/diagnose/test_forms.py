"""Other forms of a hypothesis keep what they are forms of."""

import numpy as np
import pytest

from rtctl.diagnose.forms import about_others, as_harmonic, forms, moved_into, of_first_order, renamed, richer
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.space import SHAPE
from rtctl.plants.physics import TERMS
from rtctl.plants.physics.guide import thickness
from rtctl.plants.physics.ripple import encoder

EXTRAS = {name for name, term in TERMS.items() if term.richer}
HINTS = {"order": [7.0], "wavelength": [0.02]}


def test_extras_belong_to_a_form_that_is_searched_for():
    assert EXTRAS
    assert all(TERMS[name].search for name in EXTRAS)


def test_forms_and_richer_forms_keep_the_term_and_its_place(moved):
    record, base = moved("axis")
    (h, *_) = hypotheses(record, base, only=("friction.stribeck",))
    assert [f.fixed["form"] for f in forms(h)] == ["exponential", "tustin"]
    assert forms(forms(h)[0])[0].fixed["form"] == "gaussian"
    (dahl, *_) = hypotheses(record, base, only=("friction.presliding",))
    more = richer(record, base, dahl)
    assert more.name == dahl.name and more.fixed["form"] == "lugre"
    assert [c.name for c in more.coordinates] == ["z_s", "rise", "v_s", "tau_s"]
    assert richer(record, base, more) is None  # it has them already


def test_the_edges_of_a_gap_are_round_where_a_link_has_one(moved):
    """A sensor behind a gap is drawn along by its edges, and how round they are has no say."""
    record, base = moved("ldu")
    (gap, *_) = hypotheses(record, base, only=("transmission.backlash",))
    assert [c.name for c in richer(record, base, gap).coordinates] == ["gap", "edge"]
    record, base = moved("axis")
    (gap, *_) = hypotheses(record, base, only=("transmission.backlash",))
    assert richer(record, base, gap) is None


@pytest.mark.parametrize("kind", ["ivu", "ldu", "axis"])
def test_no_shape_of_a_richer_form_leaves_what_a_config_may_hold(moved, kind):
    """A model that was found is run as it is."""
    record, base = moved(kind)
    plain = (*hypotheses(record, base, only=EXTRAS), *hypotheses(record, base, HINTS, only=EXTRAS))
    seen = set()
    for h in filter(None, (richer(record, base, h) for h in plain)):
        fields = TERMS[h.term].settings.model_fields
        for c in (c for c in h.coordinates if c.kind == SHAPE):
            seen.add((h.term, c.name))
            for bound in fields[c.name].metadata:
                assert c.scale * np.exp(c.low) >= getattr(bound, "ge", -np.inf), f"{h.term} {c.name}"
                assert c.scale * np.exp(c.high) <= getattr(bound, "le", np.inf), f"{h.term} {c.name}"
    assert ("drive.lag", "zeta") in seen


def test_a_spring_pulls_to_where_the_machine_starts_or_to_the_middle(moved):
    record, base = moved("axis")
    start, middle = hypotheses(record, base, only=("load.spring",))
    assert "x0" not in start.fixed and "x0" in middle.fixed
    assert about_others(record, base, start) == [middle]
    assert about_others(record, base, middle) == [start]
    (h, *_) = hypotheses(record, base, only=("friction.viscous",))
    assert about_others(record, base, h) == []


def test_a_flank_of_a_hill_is_moved_aside(moved):
    """What pushes on is behind the middle of the hill that it belongs to, or the other way round before it."""
    record, base = moved("axis")
    h = next(h for h in hypotheses(record, base, only=("load.bump",)) if h.fixed["form"] == "push")
    x = h.start()
    x[0] = 1.0
    push = h.values(x)
    (hill,) = [f for f in forms(h) if f.fixed["form"] == "hill"]
    found = [hill.values(y) for y in moved_into(hill, x)]
    assert [v["F"] / push["F"] for v in found] == [1.0, 1.0, -1.0]
    assert [(v["at"] - push["at"]) / push["width"] for v in found] == pytest.approx([0.0, -1.0, 1.0])
    for v in found[1:]:
        assert v["F"] * (push["at"] - v["at"]) > 0.0  # there it pushes as before
    assert all(len(moved_into(f, x)) == 1 for f in forms(h) if f.fixed["form"] != "hill")


def test_a_second_order_lag_that_never_swings_is_one_of_first_order(plain):
    record, model = plain.record, plain.model
    slow = next(h for h in hypotheses(record, model.base, only=("drive.lag",)) if h.fixed["order"] == 2)
    more = richer(record, model.base, slow)
    x = np.array([1e-3 / more.coordinates[0].scale, np.log(5.0 / more.coordinates[1].scale)])
    assert more.values(x) == pytest.approx({"tau": 1e-3, "zeta": 5.0})
    other, y = of_first_order(more, x)
    assert (other.values(y), other.fixed["order"]) == (pytest.approx({"tau": 0.01}), 1)
    none, two, one = (plain.sim.run(m) for m in (model, model.add(more.settings(x)), model.add(other.settings(y))))
    assert np.std(two - one) < 0.03 * np.std(two - none)
    assert of_first_order(more, more.start()) is None
    assert of_first_order(other, y) is None


def test_a_wave_may_be_the_second_or_the_third_of_a_longer_one(moved):
    record, base = moved("axis")
    (h, *_) = hypotheses(record, base, {"wavelength": [0.05]}, only=("guide.thickness",))
    assert list(as_harmonic(h, h.start(), 1.0)) == []  # in its plain form it is one wave
    more = richer(record, base, h)
    x = more.start()
    x[[c.name for c in more.coordinates].index("A|phi") + 1] = 2.0
    x[[c.name for c in more.coordinates].index("wavelength")] = 0.1
    term, at = TERMS["guide.thickness"], np.linspace(-0.1, 0.1, 50)

    def wave(settings):
        p = term.build(settings, record.dt)
        return [thickness(p, z) for z in at]

    own = wave(more.settings(x))
    assert np.ptp(own) > 0.0
    longer = [form.settings(y) for form, y in as_harmonic(more, x, 1.0)]
    assert [s.wavelength / more.settings(x).wavelength for s in longer] == pytest.approx([2.0, 3.0])
    for settings in longer:
        assert settings.A == 0.0 and wave(settings) == pytest.approx(own, rel=1e-9, abs=1e-15)
    ((twice, y),) = as_harmonic(more, x, 0.15)  # three times as long it would not come once in the travel
    y[[c.name for c in twice.coordinates].index("wavelength")] = twice.coordinates[2].high
    assert twice.values(y)["wavelength"] == pytest.approx(0.15)


def test_a_wave_of_a_reading_has_two_names_where_its_length_may_be_either(moved):
    record, base = moved("axis")
    found = hypotheses(record, base, {"wavelength": [0.01, 0.02, 0.15]}, only=("ripple.encoder", "guide.thickness"))
    other = {(h.term, h.coordinates[-1].scale): renamed("axis", h, h.start()) for h in found}
    assert {key for key, h in other.items() if h is not None} == {("ripple.encoder", 0.02), ("guide.thickness", 0.02)}
    own = next(h for h in found if h.term == "ripple.encoder" and h.coordinates[-1].scale == 0.02)
    x = richer(record, base, own).start() + 0.3
    laws = [richer(record, base, own), renamed("axis", richer(record, base, own), x)]
    p, q = (TERMS[h.term].build(h.settings(x), record.dt) for h in laws)
    at = np.linspace(-0.1, 0.1, 50)
    assert [encoder(p, z) - z for z in at] == pytest.approx([thickness(q, z) for z in at], abs=1e-15)
    again = renamed("axis", laws[1], x)
    assert (again.term, again.coordinates) == (laws[0].term, laws[0].coordinates)


@pytest.mark.parametrize(("kind", "term"), [("ldu", "guide.thickness"), ("ivu", "ripple.encoder")])
def test_elsewhere_a_wave_has_one_name(moved, kind, term):
    record, base = moved(kind)
    for h in hypotheses(record, base, {"wavelength": [0.02]}, only=(term,)):
        assert renamed("axis", h, h.start()) is None
