"""Units and nouns of an axis from the units of its columns."""

import pytest

from rtctl.diagnose import words
from rtctl.diagnose.quantities import quantities


@pytest.mark.parametrize(
    ("x", "u", "inertia", "force", "gain", "body"),
    [
        (None, "V", "kg", "N", "N/V", "the carriage"),
        ("m", "N", "kg", "N", "", "the carriage"),
        ("rad", "A", "kg m^2", "Nm", "Nm/A", "the rotor"),
        ("rad", "Nm", "kg m^2", "Nm", "", "the rotor"),
    ],
)
def test_units_follow_from_the_columns(x, u, inertia, force, gain, body):
    q = quantities(x, u)
    assert (q.of("M"), q.of("F_c"), q.of("K"), q.body) == (inertia, force, gain, body)


def test_a_rotary_axis_has_a_rotor_and_newton_metres():
    assert words.node_words("carriage", True) == "the rotor"
    assert words.unit_at("axis", "friction.coulomb", "carriage", "F_C", True) == "Nm"
    assert words.unit_at("axis", "transmission.backlash", "carriage", "gap", True) == "rad"
    assert words.unit_at("axis", "friction.coulomb", "carriage", "F_C") == "N"
    assert "rotor" in words.sentence("friction.coulomb:carriage", rotary=True)
