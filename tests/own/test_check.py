"""Check of a user law; each case compiles one small step."""

import re

import numpy as np
import pytest
from own_lines import line

from rtctl.config.errors import UserError
from rtctl.own import law as own_law
from rtctl.own.check import TICKS, Verdict, check, healthy
from rtctl.own.files import Source, trust
from rtctl.own.parts import own

DT = 1e-4


def verdict(text):
    trust([text])
    parts = own(Source("./try.py", "Try", text), own_law.FUNCTIONS, own_law.RESULT)
    return check(parts, parts.build(parts.settings(gain=2), DT), healthy(own_law.SIGNALS, DT, 1e-3), DT)


def test_valid_law_is_accepted_and_timed(law):
    found = verdict(law())
    assert 0 < found.median <= found.p99 <= found.worst < DT
    assert found.compiled > 0
    assert (found.spec, found.period) == ("./try.py:Try", DT)


@pytest.mark.parametrize(
    ("body", "where", "message"),
    [
        ("return p.gian * e", "p.gian", "p.gian: TryParams has no 'gian'; did you mean p.gain?"),
        ("s.q = 1.0\n    return e", "s.q", "s.q: TRY_STATE has no 'q'; it has n, x"),
        ("return plain(e)", "return plain", "does not compile: 'plain' is not compiled; write @tick above"),
        ("return 'a' + e", "return 'a'", "does not compile: there is no compiled form of add("),
        ("return np.sine(e)", "np.sine", "does not compile: "),
        (
            "a = np.zeros(3)\n    return a[0] + e",
            "a = np.zeros",
            "an array takes memory in every tick; keep it in the state",
        ),
        ("return helper(s) + e", "y = np.zeros", "an array takes memory in every tick"),
        ("return [e, e][s.n]", "return [e", "list(float64)<iv=None> takes memory in every tick"),
        ("print(e)\n    return e", "def step", "step calls Python (print, objmode)"),
        ("return s.x", "def step", "step gives an array; it should give one number, the command in V"),
        ("return s", "def step", "step gives Record; it should give one number"),
        ("s.n += 1", "def step", "step gives nothing; it should give one number"),
        ("return np.log(-1.0 - e * e)", "def step", "step gives nan in tick 0 for a healthy input (e = 0)"),
        ("s.x[0] = e / 0.0\n    return e", "def step", "s.x is no number any more"),
        (
            "if s.n >= 0:\n        raise ValueError('no')\n    return e",
            "def step",
            "step raises ValueError for a healthy",
        ),
    ],
)
def test_law_with_code_not_allowed_in_the_tick_is_refused(law, body, where, message):
    text = law(body)
    with pytest.raises(UserError, match=f"^{re.escape(f'./try.py:{line(text, where)}: {message}')}"):
        verdict(text)


def test_step_longer_than_the_tick_is_refused(law):
    slow = "t = 0.0\n    for i in range(100_000):\n        t += np.sin(e + i)\n    return t"
    with pytest.raises(
        UserError, match=r"step takes .* us in one tick of a hundred .* make it shorter, or the rate lower"
    ):
        verdict(law(slow))


def test_slow_step_is_a_warning_before_it_is_refused():
    quick = Verdict("./try.py:Try", 1.0, 1e-8, 2e-8, 3e-8, DT)
    assert quick.warning == ""
    assert "20% of the period in one tick of a hundred" in quick._replace(p99=0.2 * DT, worst=0.2 * DT).warning
    assert "its slowest step took 60%" in quick._replace(worst=0.6 * DT).warning


def test_nominal_signals_of_the_check_are_consistent():
    made = healthy(("u1", "e"), DT, 1e-3)
    assert {"u1", *own_law.SIGNALS} <= set(made)
    assert all(len(v) == TICKS and np.isfinite(v).all() for v in made.values())
    assert made["e"] == pytest.approx(made["ref"] - made["x"])
    assert np.gradient(made["ref"], DT)[100:-100] == pytest.approx(made["v_ref"][100:-100], abs=1e-5)
