import json

import pytest

from rtctl.doctor import facts, report
from rtctl.doctor.finding import Finding
from rtctl.doctor.measure import Measured, Rate

FINDINGS = [
    Finding("swap", "/dev/sda2", "fair", "costs", "switch it off", "sudo swapoff -a"),
    Finding("SMT", "off", "good"),
]


@pytest.fixture
def measured(lateness):
    slow = Rate(500.0, lateness({15_000: 2_500}), lateness({15_000: 2_500}, skipped=None))
    fast = Rate(10_000.0, lateness({15_000: 49_800, 90_000: 100}, late=100, skipped=100), None)
    return Measured([slow, fast], 1, 80, 1, 5, [], "cyclictest is not installed here")


def test_sentence_for_a_held_rate(measured):
    assert report.sentence(measured.rates[0]) == (
        "This machine can hold 500 Hz: a wake-up later than half a period (1000 us) happened in 0 of 2500 ticks."
    )


def test_sentence_for_a_rate_that_was_not_held(measured):
    assert report.sentence(measured.rates[1]) == (
        "This machine cannot hold 10 kHz: a wake-up later than half a period (50 us) happened in 200 of 50000 ticks "
        "(0.4 %)."
    )


def test_report_figures(lateness):
    said = report.figures(lateness({15_000: 990, 250_000: 10}, late=4, skipped=2))
    assert said.startswith("p50 15.") and said.endswith("max 250 us; 4 of 1002 late, 2 skipped")
    assert "late" not in report.figures(lateness({15_000: 1}, late=None, skipped=None))


def test_json_report_is_complete(tree, measured):
    t = tree({"proc/sys/kernel/hostname": "bench", "proc/sys/kernel/osrelease": "6.12"})
    found = json.loads(json.dumps(report.as_json(t, FINDINGS, measured, 10_000.0)))
    assert (found["host"], found["kernel"], found["change"]) == ("bench", "6.12", ["swap"])
    assert found["facts"][0] == FINDINGS[0]._asdict()
    assert found["need"] == {"rate_hz": 10_000.0, "held": False}
    m = found["measured"]
    assert (m["cpu"], m["priority"], m["window_s"], m["rounds"], m["lacks"]) == (1, 80, 1, 5, [])
    assert m["without_cyclictest"] == measured.without
    slow, fast = m["rates"]
    assert (slow["rate_hz"], slow["held"], slow["late"], slow["half_period_us"]) == (500.0, True, 0, 1000.0)
    assert (fast["held"], fast["late"], fast["cyclictest"]) == (False, 200, None)
    assert fast["sentence"] == report.sentence(measured.rates[1])
    ours = fast["rtctl"]
    assert (ours["ticks"], ours["late"], ours["skipped"]) == (50_000, 100, 100)
    assert set(ours["lateness_us"]) == {"p50", "p99", "p999", "max"}
    assert ours["histogram"]["count"] == [49_800, 100]
    low, high = ours["histogram"]["from_us"]
    assert low <= 15 < 1.04 * low and high <= 90 < 1.04 * high


def test_report_without_a_measurement(tree):
    found = report.as_json(tree(), facts.facts(tree(), 80, True, FINDINGS[1]), None, None)
    assert (found["measured"], found["need"], found["host"]) == (None, None, None)


def test_report_title(tree):
    assert report.title(tree()) == "this machine: Linux ?"
    t = tree({f"proc/sys/kernel/{k}": v for k, v in (("hostname", "a"), ("osrelease", "6.1"), ("version", "#1 SMP"))})
    assert report.title(t) == "a: Linux 6.1 #1 SMP"
