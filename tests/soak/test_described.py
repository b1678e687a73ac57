"""What a random day asks of a described machine follows from its own reference."""

import numpy as np
import pytest

from rtctl import machines
from rtctl.cli.common import load_config
from rtctl.config.errors import UserError
from rtctl.config.load import set_path
from rtctl.soak import ranges


def test_moves_are_those_of_the_reference():
    config = load_config("belt", [])
    found = ranges.range_of(machines.build(config))
    assert found.travel == 12.0 and found.rate == pytest.approx((3.0, 15.0))
    assert (found.counts, found.truth, found.outputs) == ("encoder_counts", "truth_motor", ("u",))
    assert ranges.counts_per_unit(config) == pytest.approx(8000 / (2 * np.pi))
    assert set(ranges.gains_of(config)) == {"law.position.gain"}


def test_commands_reach_the_limit_and_half_a_code():
    low, high = ranges.volts(load_config("belt", []))
    assert high == -low == pytest.approx(10.0 + 10.0 / 2**16)
    low, high = ranges.volts(load_config("two-motor", ["law.shares={servo2: 1.5}"]))
    assert high == pytest.approx(12.0, abs=1e-3)


def test_a_machine_that_shows_no_counts_is_not_judged_by_them():
    assert np.isnan(ranges.counts_per_unit(load_config("spindle", [])))


def test_a_day_needs_a_reference_to_go_by():
    still = set_path(load_config("belt", []), "reference", {})
    with pytest.raises(UserError, match="a soak moves as the reference does"):
        ranges.with_reference(still)
