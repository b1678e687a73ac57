import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.errors import UserError
from rtctl.trace.trigger import Trigger

NAMES = ("tick", "error", "u1", "capstan_error")
ROW = np.dtype([(name, "i8" if name == "tick" else "f8") for name in NAMES])


def rows(**columns) -> np.ndarray:
    made = np.zeros(len(next(iter(columns.values()))), ROW)
    for name, values in columns.items():
        made[name] = values
    return made


def holds(expression: str, **values: float) -> bool:
    """Whether the condition holds in one row, evaluated after a row with a false or true condition."""
    trigger = Trigger(expression, NAMES)
    trigger._was = False
    return trigger(rows(**{name: [value] for name, value in values.items()})) == 0


@pytest.mark.parametrize("error", [-2.0, 0.0, 0.5, 3.0])
@pytest.mark.parametrize(
    "expression",
    [
        "error > 0.4",
        "abs(error) > 1e-3 and u1 < 2",
        "not error >= 0.5 or u1 == 1",
        "0 < error <= 0.5",
        "-error * 2 + u1 / 4 - 1 != 0",
        "min(error, u1, 0.2) < max(0.1, error)",
        "1 / error > 0",
        "(error > 0) and (not (u1 > 5) or error < 1)",
        "tick < 1 and error < 1",
    ],
)
def test_trigger_expression_agrees_with_python(expression, error):
    with np.errstate(all="ignore"):
        expected = eval(expression, {"error": np.float64(error), "u1": np.float64(1.0), "tick": 0})
    assert holds(expression, error=error, u1=1.0) == bool(expected)


def test_trigger_fires_at_a_rising_edge_also_across_batches():
    trigger = Trigger("error > 1", NAMES)
    assert trigger(rows(error=[0, 0, 2, 2, 0])) == 2
    assert trigger(rows(error=[0, 0.5])) == -1
    assert trigger(rows(error=[2, 2])) == 0
    assert trigger(rows(error=[2, 2])) == -1  # no edge: still true
    assert trigger(rows(error=[])) == -1
    assert trigger(rows(error=[2, 0, 0, 3])) == 3


def test_condition_true_from_the_start_does_not_fire():
    trigger = Trigger("error > 1", NAMES)
    assert trigger(rows(error=[2, 2])) == -1
    assert trigger(rows(error=[2, 0, 2])) == 2


@settings(deadline=None)
@given(st.lists(st.booleans(), max_size=40), st.lists(st.integers(0, 40), max_size=6))
def test_trigger_does_not_depend_on_the_batches(high, cuts):
    data = rows(error=np.array(high, dtype=float), tick=np.arange(len(high)))
    trigger, fired = Trigger("error > 0.5", NAMES), []
    for part in np.split(data, sorted(min(cut, len(high)) for cut in cuts)):
        index = trigger(part)
        if index >= 0:
            fired.append(int(part["tick"][index]))
    edges = [k for k in range(1, len(high)) if high[k] and not high[k - 1]]
    assert fired[:1] == edges[:1] and set(fired) <= set(edges)


def test_constant_condition_never_fires():
    assert Trigger("1 < 2", NAMES)(rows(error=[0, 0])) == -1


def test_comparison_with_nan_is_false():
    trigger = Trigger("error > 1", NAMES)
    assert trigger(rows(error=[0, np.nan, 2])) == 2


@pytest.mark.parametrize(
    ("expression", "words"),
    [
        ("capstan_eror > 0.05", "no signal 'capstan_eror'; did you mean 'capstan_error'"),
        ("zzz > 1", "no signal 'zzz'; there are tick, error"),
        ("u1 < 2 V", "cannot be read near column 8; .*no units"),
        ("", "cannot be read"),
        ("error >", "cannot be read"),
        ("error", "'error' is a number, where a condition such as u > 2 is needed"),
        ("error and u1 > 2", "'error' is a number"),
        ("(error > 1) + 2 > 1", "'error > 1' is a condition, where a number is needed"),
        ("abs(error, u1) > 1", "needs one argument"),
        ("max(error) > 1", "needs two arguments"),
        ("max(error, key=u1) > 1", "not allowed"),
        ("error ** 9 > 1", "not allowed"),
        ("error is u1", "not a comparison of numbers"),
        ("error > 'a'", "not allowed"),
        ("error > True", "not allowed"),
        ("error > 1j", "not allowed"),
        ("error > " + "9" * 400, "too large a number"),
        ("error\0 > 1", "cannot be read"),
        ("__import__('os').system('true')", "not allowed"),
        ("error.real > 1", "not allowed"),
        ("[error][0] > 1", "not allowed"),
        ("(lambda: error)() > 1", "not allowed"),
        ("error > 1 if u1 > 1 else u1 > 2", "not allowed"),
        ("(" * 240 + "error" + ")" * 240 + " > 1", "cannot be read"),
        ("-" * 400 + "error > 1", "too many parts"),
        ("error > 1 and " * 50 + "u1 > 1", "characters long"),
    ],
)
def test_invalid_expression_is_refused(expression, words):
    with pytest.raises(UserError, match=words):
        Trigger(expression, NAMES)


@given(st.text(alphabet="eru1 ()<>=+-*/.andotbsmix,0%[]{}:'\"\\\n", max_size=40))
def test_any_text_is_either_a_trigger_or_a_user_error(text):
    try:
        trigger = Trigger(text, ("e", "u1"))
    except UserError:
        return
    data = np.zeros(3, [("e", "f8"), ("u1", "f8")])
    assert -1 <= trigger(data) < 3


def test_invalid_expression_raises_no_additional_warning(recwarn):
    with pytest.raises(UserError):
        Trigger("abs(x) > 1in", ["x"])
    assert not recwarn.list
