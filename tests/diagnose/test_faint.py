"""Effects beneath random forces: there, borne out by the blocks, and asked for only where errors are noise."""

from types import SimpleNamespace

import numpy as np
import pytest
from by_hand import made

from rtctl.diagnose import faint as beneath
from rtctl.diagnose.faint import RATIO, SURE, evidence, faint, stands_out

PROBLEM = SimpleNamespace(block=50)
NOISE = np.random.default_rng(1).standard_normal(20000)
WAVE = np.sin(0.01 * np.arange(20000))


@pytest.mark.parametrize("size", [0.05, 0.1, 0.3])
def test_a_term_of_this_size_is_as_sure_as_white_noise_lets_it_be(size):
    found = evidence(PROBLEM, made(NOISE + size * WAVE), made(NOISE, 1))
    sure = size * np.sqrt(0.5 * len(WAVE))
    assert found.sure == pytest.approx(sure, rel=0.2)
    assert found.ratio == pytest.approx(sure**2, rel=0.35)


def test_what_one_block_alone_bears_out_is_not_sure():
    once = np.where(np.arange(20000) < 50, 3.0, 0.0) * np.sign(NOISE)
    found = evidence(PROBLEM, made(NOISE + once), made(NOISE, 1))
    assert found.ratio > RATIO
    assert found.sure < SURE


def test_it_takes_both(monkeypatch):
    monkeypatch.setattr(beneath.decide, "at_end", lambda before, after: False)
    assert stands_out(PROBLEM, made(NOISE + 0.15 * WAVE), made(NOISE, 1))
    assert not stands_out(PROBLEM, made(NOISE + 0.05 * WAVE), made(NOISE, 1))
    monkeypatch.setattr(beneath.decide, "at_end", lambda before, after: True)
    assert not stands_out(PROBLEM, made(NOISE + 0.15 * WAVE), made(NOISE, 1))


@pytest.mark.parametrize(("plant", "louder", "quiet"), [("ldu", 1.0, True), ("ivu", 1.4, True), ("axis", 1.0, False)])
def test_nothing_is_asked_where_what_is_left_may_be_no_noise(monkeypatch, plant, louder, quiet):
    monkeypatch.setattr(beneath.decide, "quiet", lambda problem, base, fitted: quiet)
    problem = SimpleNamespace(sim=SimpleNamespace(record=SimpleNamespace(plant=plant)), louder=louder)
    assert faint(problem, made(NOISE), []) is None


def test_a_machine_that_lacks_nothing_has_none(plain, searched):
    problem, base, looked = searched(plain)
    said = []
    assert faint(problem, base, [s.hypothesis for s in looked.scores], said.append) is None
    assert said == ["looking beneath the random forces"]
