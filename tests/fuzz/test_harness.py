"""Fuzz harness: each planted failure is found with its input."""

import faulthandler
import os
import resource
import signal
import time
import warnings

import numpy as np
import pytest
from harness import GROWTH, ROOM, run
from target import Kind, Target

BAD = b"bad"


def planted(what):
    """A target that accepts every input except BAD, its fifth input."""

    def make(_):
        numbers = iter(range(1, 10**6))

        def feed(data):
            if data == BAD:
                what()

        return Target(feed, lambda rng: BAD if next(numbers) == 5 else b"good")

    return Kind(make, 1)


def raises():
    raise KeyError("no such thing")


def hangs():
    time.sleep(60)


def warns():
    warnings.warn("look here", SyntaxWarning, stacklevel=1)


def dies():
    faulthandler.disable()  # pytest's: a page of where we are
    signal.raise_signal(signal.SIGSEGV)


def leaves():
    os._exit(7)


def grows():
    np.ones(2 * GROWTH // 8)


def bursts():
    np.ones(2 * ROOM // 8)


@pytest.mark.parametrize(
    ("what", "told"),
    [
        (raises, ("KeyError: 'no such thing' (test_harness.py:",)),
        (warns, ("SyntaxWarning: look here",)),
        (dies, ("died by SIGSEGV",)),
        (leaves, ("ended by itself",)),
        (grows, ("took 5", "Unable to allocate", "no end within")),  # the last on a machine that is too slow for it
        (bursts, ("MemoryError", "Unable to allocate")),
    ],
)
def test_planted_failure_is_found_with_its_input(what, told):
    core = resource.getrlimit(resource.RLIMIT_CORE)
    resource.setrlimit(resource.RLIMIT_CORE, (0, core[1]))
    found = run("planted", planted(what), 20)
    resource.setrlimit(resource.RLIMIT_CORE, core)
    assert found.inputs >= 20 and found.findings
    assert any(words in found.findings[0].what for words in told)
    assert {finding.input for finding in found.findings} == {BAD}


def test_hang_is_found_and_the_run_continues():
    found = run("planted", planted(hangs), 8, patience=0.3)
    assert [finding.what for finding in found.findings] == ["no end within 0.3 s"]
    assert found.findings[0].input == BAD and found.inputs == 8


def test_correct_target_has_no_findings():
    found = run("planted", planted(lambda: None), 500)
    assert (found.inputs, found.findings) == (500, [])


def test_equal_seeds_give_equal_inputs():
    def remember(_):
        def feed(data):
            raise ValueError(data.hex())

        return Target(feed, lambda rng: rng.randbytes(4))

    one, two, other = (run("planted", Kind(remember, 1), 3, seed=seed).findings for seed in (1, 1, 2))
    assert one == two != other
