from rtctl.laws import two_tap


def test_two_tap_is_the_mean_of_the_last_two_values(zero):
    s = zero(two_tap.TWO_TAP_STATE)
    assert [two_tap.step(s, x) for x in (3.0, 5.0, 4.0)] == [3.0, 4.0, 4.5]
    two_tap.reset(s)
    assert two_tap.step(s, 7.0) == 7.0
