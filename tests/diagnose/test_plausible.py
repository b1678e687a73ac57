"""Which sizes a machine may have."""

from by_hand import with_terms

from rtctl.diagnose.plausible import absurd, unusual


def test_typical_angles_say_nothing_of_ways():
    ripple = ("ripple.encoder", "encoder")
    assert unusual(with_terms(ripple, sizes=(3e-5,))) < -1.0
    assert unusual(with_terms(("ripple.encoder", "sensor"), kind="axis", sizes=(3e-5,))) == 0.0


def test_less_friction_than_the_owners_is_less_likely_than_more():
    more, less = (with_terms(("friction.viscous", "carriage"), kind="axis", sizes=(B,)) for B in (5.0, -5.0))
    assert unusual(more) == unusual(less) + 2.0


def test_a_size_beyond_all_that_is_typical_is_no_machines():
    wave = ("drive.offset", "drive1")
    assert not absurd(with_terms(wave, sizes=(0.5,))) and not absurd(with_terms(wave, sizes=(1e-6,)))
    assert absurd(with_terms(wave, sizes=(-7.0,)))
