"""Tension-dependent path length of the old reel unit, in a recording of one move."""

import pytest

import rtctl
from rtctl.diagnose.answer.load import load
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.search.hypotheses import hypotheses
from rtctl.diagnose.search.screen import screen

LONGER = {"term": "tape.path_length", "node": "path", "excess": "5.9 mm"}
MOVE = [{"at": "0.5 s", "to": "-4 rad", "ramp": "1.6 rad/s"}]


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    folder = tmp_path_factory.mktemp("old") / "bundle"
    changes = {"plant.physics": [LONGER], "reference.steps": MOVE, "loop.mode": "fused"}
    rtctl.record(rtctl.load_config("ivu-old", changes), 5.0, folder)
    return refit(*together([load(folder)]))


def test_path_length_has_the_largest_screening_gain(base):
    looked = screen(base, hypotheses(base.like.sim, base.model))
    first = max(looked.scores, key=lambda score: score.gain).hypothesis.name
    assert first == "tape.path_length:path"
    fits = [
        refit(base.like, base.space.add(score.hypothesis), x)
        for score in looked.scores if score.hypothesis.name == first for x in looked.starts(score, 1)
    ]  # fmt: skip
    found = max(fits, key=lambda f: f.log_evidence)
    assert found.log_evidence > base.log_evidence + 1000.0
    assert found.e[:, 0].std() < 0.3 * base.e[:, 0].std()
