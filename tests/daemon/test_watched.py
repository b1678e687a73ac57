"""Reports of a watch: the last report, its sentence, and the silence timeout."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.daemon import watched
from rtctl.daemon.metrics import MachineCollector
from rtctl.daemon.protocol import ProtocolError, decode_request, encode_request
from rtctl.daemon.watched import SILENT, Watched, sentence
from rtctl.loop.records import STATUS

GOOD = {"state": "watching", "residual": {"encoder": 1.04}}
ALARM = {**GOOD, "alarm": {"t": 12.0, "words": "drag that the model lacks, at motor 2: 3.1 mNm of torque"}}


@pytest.fixture
def clock(monkeypatch):
    now = SimpleNamespace(at=100.0)
    monkeypatch.setattr(watched, "time", SimpleNamespace(monotonic=lambda: now.at))
    return now


def test_no_watch_report_means_no_sentence():
    assert Watched().told is None
    assert Watched().sentence() is None


def test_silent_watch_is_reported(clock):
    kept = Watched()
    kept.take(GOOD)
    assert kept.sentence() == "holds: encoder 1 sigma"
    clock.at += SILENT + 1.0
    assert kept.told["silent"] is True
    assert kept.sentence() == "nobody watches: `rtctl watch` is silent for 11 s"


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({"state": "waiting"}, "waits for motion"),
        ({"state": "learning", "learned": 0.4}, "learns the band of the machine, 40 %"),
        (
            {"state": "astray", "notes": ["the model ran away"]},
            "diverges from the rows and cannot judge the machine; the model ran",
        ),
        (ALARM, "departs from the machine since 12 s: drag that the model lacks"),
    ],
)
def test_watch_sentence_for_each_state(told, words):
    assert sentence({"silent": False, "residual": {}, **told}).startswith(words)


def test_metrics_show_an_alarm_and_drop_it_for_a_silent_watch(clock):
    kept = Watched()
    collector = MachineCollector("ivu", np.zeros(1, STATUS)[0], dict, lambda: kept.told, "real")

    def found():
        return {(s.name, s.labels.get("sensor")): s.value for family in collector.collect() for s in family.samples}

    assert found()["rtctl_build_info", None] == 1.0
    assert ("rtctl_model_alarm", None) not in found()
    kept.take(ALARM)
    assert found()["rtctl_model_alarm", None] == 1.0
    assert found()["rtctl_residual_sigma", "encoder"] == 1.04
    clock.at += SILENT + 1.0
    assert ("rtctl_model_alarm", None) not in found()


def test_watch_report_is_validated():
    asked = decode_request(encode_request(1, "watch", ALARM))
    assert asked.args.alarm.words.startswith("drag")
    with pytest.raises(ProtocolError, match="state"):
        decode_request(encode_request(1, "watch", {"state": "fine"}))
