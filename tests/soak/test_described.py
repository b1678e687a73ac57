"""Random soak of a described machine: ranges of commands follow from its reference."""

import numpy as np
import pytest

from rtctl import machines
from rtctl.cli.common import load_config
from rtctl.config.errors import UserError
from rtctl.config.load import set_path
from rtctl.soak import ranges


def test_random_moves_have_the_range_of_the_reference():
    config = load_config("belt", [])
    found = ranges.range_of(machines.build(config))
    assert found.travel == 12.0 and found.rate == pytest.approx((3.0, 15.0))
    assert (found.counts, found.truth, found.outputs) == ("encoder_counts", "truth_motor", ("u",))
    assert ranges.counts_per_unit(config) == pytest.approx(8000 / (2 * np.pi))
    assert set(ranges.gains_of(config)) == {"law.position.gain"}


def test_random_commands_reach_the_limit_and_half_a_code():
    low, high = ranges.volts(load_config("belt", []))
    assert high == -low == pytest.approx(10.0 + 10.0 / 2**16)
    low, high = ranges.volts(load_config("two-motor", ["law.shares={servo2: 1.5}"]))
    assert high == pytest.approx(12.0, abs=1e-3)


def test_machine_without_counts_is_not_checked_for_lost_counts():
    assert np.isnan(ranges.counts_per_unit(load_config("spindle", [])))


def test_soak_needs_a_reference():
    still = set_path(load_config("belt", []), "reference", {})
    with pytest.raises(UserError, match="a soak moves as the reference does"):
        ranges.with_reference(still)
