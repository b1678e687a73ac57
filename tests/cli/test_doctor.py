"""`rtctl doctor` with a stubbed measurement, and once with a true one."""

import json

import numpy as np
import pytest

from rtctl.doctor import cyclictest, rights
from rtctl.doctor.measure import Lateness, Measured, Rate
from rtctl.loop import histogram


@pytest.fixture
def asked(monkeypatch):
    """Arguments of a stubbed measurement. At 10 kHz two ticks of 1000 are late, at other rates one."""
    calls = []

    def measure(rates, seconds, cpu, priority, fifo, lock, say):
        calls.append((rates, seconds, cpu))
        record = np.zeros(1, histogram.HISTOGRAM)[0]
        record["bucket"][200], record["count"], record["max"] = 1000, 1000, 9_000
        made = [
            Rate(hz, Lateness(1000, 2 if hz == 10_000 else 1, 0, histogram.percentiles(record), record), None)
            for hz in rates
        ]
        return Measured(made, cpu, priority, 1, seconds, [], cyclictest.missing() or "not asked")

    monkeypatch.setattr("rtctl.doctor.measure.measure", measure)
    return calls


def test_doctor_prints_the_rates_this_machine_can_hold(rtctl, asked):
    code, out, err = rtctl("doctor")
    words = " ".join(out.split())
    assert (code, err) == (0, "")
    assert "This machine can hold 500 Hz" in words and "This machine cannot hold 10 kHz" in words
    assert "kernel preemption" in words and "2 of 1000 ticks" in words
    assert asked[0][:2] == ([500.0, 10_000.0], 5)


def test_doctor_as_json(rtctl, asked):
    code, out, _ = rtctl("doctor", "--json", "--seconds", 3, "--rate", 2000)
    found = json.loads(out)
    assert code == 0
    assert [r["rate_hz"] for r in found["measured"]["rates"]] == [2000.0]
    assert {f["verdict"] for f in found["facts"]} <= {"good", "fair", "bad", "unknown"}
    assert found["need"] is None
    assert asked[0][:2] == ([2000.0], 3)


@pytest.mark.parametrize(("need", "code"), [(500, 0), (3000, 0), (10_000, 1)])
def test_needed_rate_sets_the_exit_code(rtctl, asked, need, code):
    said = rtctl("doctor", "--json", "--need", need)
    assert said.code == code
    assert json.loads(said.out)["need"] == {"rate_hz": float(need), "held": code == 0}
    assert float(need) in asked[0][0]


def test_unsuitable_machine_is_not_an_error(rtctl, asked, monkeypatch):
    monkeypatch.setattr(rights, "may_fifo", lambda priority: False)
    code, out, _ = rtctl("doctor", "--json")
    found = json.loads(out)
    assert (code, found["change"][0]) == (0, "SCHED_FIFO")
    assert found["facts"][0]["verdict"] == "bad"


def test_running_machines_are_noted(rtctl, asked, monkeypatch):
    monkeypatch.setattr("rtctl.cli.common.running", lambda: ["ivu", "ldu"])
    assert "not alone: ivu, ldu runs here" in json.loads(rtctl("doctor", "--json").out)["measured"]["lacks"][0]
    assert "note: not alone" in rtctl("doctor").out


def test_no_measure_skips_the_measurement(rtctl, asked):
    code, out, _ = rtctl("doctor", "--no-measure", "--json")
    found = json.loads(out)
    assert (code, found["measured"], asked) == (0, None, [])
    assert "hold" not in rtctl("doctor", "--no-measure").out


def test_plot_writes_a_picture(rtctl, asked, tmp_path):
    assert rtctl("doctor", "--plot", tmp_path / "a.png").code == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--rate", 1), "--rate 1: a rate is 10 to 50000 Hz"),
        (("--need", 1e6), "--need 1e+06: a rate is 10 to 50000 Hz"),
        (("--need", "nan"), "--need nan: a rate is"),
        (("--no-measure", "--need", 500), "--need needs a measurement"),
        (("--no-measure", "--plot", "a.png"), "--plot needs a measurement"),
        (("--plot", "a.pdf"), "name it a.png"),
        (("--plot", "nowhere/a.png"), "there is no folder nowhere"),
        (("--cpu", 4095), "--cpu 4095: there is no such CPU"),
        (("--seconds", 0), "--seconds"),
    ],
)
def test_invalid_arguments_are_exit_code_2(rtctl, asked, arguments, words):
    code, out, err = rtctl("doctor", *arguments)
    assert (code, out, asked) == (2, "", [])
    assert words in err


@pytest.mark.realtime
def test_doctor_with_a_true_measurement(rtctl):
    code, out, err = rtctl("doctor", "--json", "--seconds", 1, "--rate", 100)
    assert (code, err) == (0, "")
    measured = json.loads(out)["measured"]
    ours = measured["rates"][0]["rtctl"]
    assert ours["ticks"] >= 100
    assert sum(ours["histogram"]["count"]) + ours["skipped"] == ours["ticks"]
    assert (measured["rates"][0]["cyclictest"] is None) == (measured["without_cyclictest"] is not None)
