"""Steps: one function for compiled code and for Python, compiled on demand."""

import numpy as np
import pytest
from numba import njit

from rtctl.idiom import state, tick

STATE = state(n=int, x=(float, 3))


@tick
def third(s, x):
    """Sum of thirds."""
    s.n += 1
    s.x[s.n % 3] = x / 3.0
    return s.x[0] + s.x[1] + s.x[2]


@njit
def play(s, x):
    y = 0.0
    for k in range(len(x)):
        y = third(s[0], x[k])
    return y


@pytest.fixture
def s():
    return np.zeros(1, STATE)


def test_python_and_compiled_calls_are_bit_exact(s):
    x = np.random.default_rng(1).normal(size=100)
    there = np.zeros(1, STATE)
    here = [third(s[0], value) for value in x.tolist()][-1]
    assert play(there, x) == here != 0.0
    assert there == s and s["n"] == 100


def test_compiled_calls_have_no_wrappers(s):
    @tick
    def inner(x):
        return x + 1.0

    assert njit(lambda x: inner(x))(1.0) == 2.0
    (code,) = inner.inspect_llvm().values()
    assert "define" in code and "PyArg" not in code and len(inner.overloads) == 1
    assert inner(2.0) == 3.0


def test_step_keeps_name_docstring_and_module():
    assert (third.__name__, third.__doc__, third.__module__) == ("third", "Sum of thirds.", __name__)
    assert third.py_func(np.zeros(1, STATE).view(np.recarray)[0], 3.0) == 1.0


def test_division_by_zero_does_not_raise():
    @tick
    def divided(a, b):
        return a / b

    assert divided(1.0, 0.0) == np.inf


def test_interpreted_call_is_bit_exact_and_compiles_nothing(s):
    @tick
    def ninth(s, x):
        """A step that calls another one."""
        return third(s, x / 3.0)

    here, there = s.view(np.recarray), np.zeros(1, STATE)
    assert ninth.interpret(here[0], 0.7) == ninth(there[0], 0.7) != 0.0
    assert there == s
    compiled = [len(step._outer.nopython_signatures) for step in (third, ninth)]
    assert ninth.interpret(here[0], np.float32(0.7)) != 0.0
    assert [len(step._outer.nopython_signatures) for step in (third, ninth)] == compiled


def test_failed_interpreted_step_leaves_other_steps_compiled(s):
    @tick
    def fails(s):
        """Raises in Python only."""
        raise KeyError(0)

    with pytest.raises(KeyError):
        fails.interpret(s[0])
    third(s[0], np.float32(1.0))  # a type that no other test gives compiled code
    assert any("float32" in str(types) for types in third._outer.nopython_signatures)
