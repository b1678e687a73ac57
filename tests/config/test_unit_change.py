"""Settings in other units: replaced unit symbols, and classes with quantities in the new units."""

import pytest
from pydantic import ValidationError

from rtctl.config.unit_change import changed, with_units
from rtctl.config.units import to_si
from rtctl.idiom import Settings
from rtctl.laws.limit import LimitSettings
from rtctl.machines.ldu import PositionSettings

TURNS = {"V": "Nm", "rad": "rad/s", "m": "rad/s"}


class Law(Settings):
    position: PositionSettings
    limit: LimitSettings = LimitSettings(high=3.0)
    plain: int = 1


@pytest.mark.parametrize(("unit", "symbols", "expected"), [
    ("V/m", {"V": "A", "m": "rad"}, "A/rad"), ("V*s^2/m", {"V": "percent", "m": "rad/s"}, "percent*s^3/rad"),
    ("m/s", {"m": "rad/s"}, "rad/s^2"), ("m", {"m": "m"}, "m"),
    ("1/m", {"m": "rad"}, "1/rad"), ("Hz", {"m": "rad"}, "Hz"),
])  # fmt: skip
def test_unit_symbols_are_replaced(unit, symbols, expected):
    assert changed(unit, symbols) == expected
    assert to_si(f"2 {expected}", expected) == 2.0  # a valid unit


def test_converted_class_accepts_quantities_in_the_new_units():
    made = with_units(Law, TURNS)
    law = made.model_validate({"position": {"kind": "pi_velocity", "gain": "3 mNm*s/rad"}, "limit": {"high": "2 Nm"}})
    assert law.position.gain == pytest.approx(3e-3) and law.limit.high == 2.0
    with pytest.raises(ValidationError, match=r"'3 V/m' is not a quantity in Nm\*s/rad"):
        made.model_validate({"position": {"kind": "pd", "gain": "3 V/m"}})


def test_defaults_and_bounds_are_kept():
    made = with_units(Law, TURNS)
    law = made.model_validate({"position": {"kind": "pd", "gain": 1.0}})
    assert law.limit.high == 3.0 and isinstance(law, Law) and isinstance(law.limit, LimitSettings)
    with pytest.raises(ValidationError, match="greater than or equal"):
        made.model_validate({"position": {"kind": "pd", "gain": -1.0}})


def test_equal_units_give_the_same_class():
    assert with_units(Law, TURNS) is with_units(Law, dict(TURNS))
    assert with_units(Law, {"V": "V"}) is Law
