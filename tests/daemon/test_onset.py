"""State fields that two machines share are carried over to the second machine."""

import numpy as np
import pytest

from rtctl.config.load import set_path
from rtctl.daemon.onset import carry
from rtctl.watch.rehearsal import Shift, usual


def test_common_state_fields_are_copied_and_others_stay():
    inner = np.dtype([("x", float, 2), ("v", float)])
    one = np.zeros(1, [("m", inner), ("gone", int), ("kind", np.int32)])
    two = np.zeros(1, [("m", inner), ("new", float), ("kind", np.int64)])
    one["m"]["x"], one["gone"], one["kind"] = [1.0, 2.0], 7, 5
    two["new"] = 3.0
    carry(one, two)
    np.testing.assert_allclose(two["m"]["x"], [[1.0, 2.0]])
    assert (two["new"][0], two["kind"][0]) == (3.0, 0)  # a field of another type is not copied


@pytest.mark.parametrize("physics", [[], [{"term": "friction.viscous", "node": "motor2", "B": 1e-3}]])
def test_machine_continues_from_the_state_of_its_predecessor(physics):
    from rtctl import api

    config = api.load_config("ivu")
    shift, rng = Shift(config), np.random.default_rng(0)
    before = shift.play(usual(config), rng, 5.0)
    other = shift.become(set_path(config, "plant.physics", physics))
    after = other.run(500)
    assert after["tick"][0] == before["tick"][-1] + 1
    assert after["t"][0] == pytest.approx(before["t"][-1] + 2e-3)
    assert abs(after["capstan"][0] - before["capstan"][-1]) < 0.02
    assert not after["trip"].any()
    if not physics:
        same = shift.run(500)
        np.testing.assert_array_equal(after["capstan"], same["capstan"])
