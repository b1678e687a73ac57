"""Clock of a recording: import and diagnosis accept the same time columns."""

import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.diagnose.record.format1 import load_record
from rtctl.trace.clock import even_rows, usual_step
from rtctl.trace.imports.make import make_bundle
from rtctl.trace.imports.plan import Plan
from rtctl.trace.imports.table import Table

K = np.arange(25_000)


def row(k):
    return f"a.csv: time, line {k + 2}"


FEW_DIGITS = {
    "three decimals at 10 kHz": (np.round(K / 10_000, 3), 10_000.0),
    "ticks of 1 ms at 1.024 kHz": (np.floor(K / 1.024) / 1000, 1024.0),
    "ticks of 1 ms at 400 Hz": (np.floor(K * 2.5) / 1000, 400.0),
    "two decimals at 30 Hz": (np.round(K / 30, 2), 30.0),
    "ticks of 1/64 s at 50 Hz": (np.floor(K / 50 * 64) / 64, 50.0),
    "single precision at 10 kHz": ((K / 10_000 + 100).astype(np.float32).astype(float), 10_000.0),
}


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("name", FEW_DIGITS)
def test_clock_of_few_digits_is_made_even(name, told):
    t, rate = FEW_DIGITS[name]
    clock = even_rows(t, rate if told else None, row)
    assert clock.rate == pytest.approx(rate, rel=1e-9)
    assert np.abs(clock.t - (clock.t[0] + K / rate)).max() < 3e-3 / rate
    assert np.abs(clock.t - t).max() <= np.ptp(np.diff(t)) and "laid on an even clock of" in clock.note


@pytest.mark.parametrize("name", FEW_DIGITS)
def test_diagnosis_accepts_every_imported_clock(tmp_path, name):
    t, rate = FEW_DIGITS[name]
    u = np.sign(np.sin(K / 500.0))
    table = Table(tmp_path / "a.csv", {"t": t, "u": u, "x": np.cumsum(u) * 1e-5}, {})
    made = make_bundle(table, Plan(plant="axis", rate=rate, parameters={"M": 95.0}), tmp_path / "b")
    record = load_record(tmp_path / "b")
    assert made.rate == rate and record.dt == 1 / rate
    assert np.diff(record.t) == pytest.approx(1 / rate, rel=1e-6)


def test_lost_row_under_a_clock_of_few_digits_is_reported(tmp_path):
    t = np.round(np.delete(K, [1000, *range(5000, 5040)]) / 10_000, 3)
    with pytest.raises(UserError, match=r"line 1016: 0.102 s is more than the last digit .0.001 s. off an even clock"):
        even_rows(t, 10_000.0, row)


def test_diagnosis_makes_the_clock_of_a_foreign_bundle_even(tmp_path):
    t, rate = FEW_DIGITS["ticks of 1 ms at 400 Hz"]
    assert 1 / np.median(np.diff(t)) != pytest.approx(rate, rel=0.1)
    clock = even_rows(t, rate, row, "sample_rate in case.json is {:g} Hz", gaps=True)
    assert clock.rate == rate and np.diff(clock.t) == pytest.approx(1 / rate)


def test_clock_of_full_precision_is_unchanged():
    for t in (K * 1e-3, K / 1024, 0.3 + K / 3000, np.round(K / 3000, 9)):
        clock = even_rows(t, None, row)
        assert clock.t is t and clock.note == ""


JITTER = np.random.default_rng(7).uniform(-0.2e-3, 0.2e-3, len(K))


@pytest.mark.parametrize(
    ("t", "rate", "words"),
    [
        (
            np.delete(K, 900) / 1000,
            None,
            "line 902: 0.002 s after the row before where 0.001 s is usual; keep an uneven clock with --uneven",
        ),
        (np.delete(K, 900) / 1000, 1000.0, "line 902: 0.002 s after the row before where 0.001 s is usual"),
        (np.insert(K, 900, 899) / 1000, None, "line 902: 0.899 s after 0.899 s; time should increase; .* with --rate"),
        (np.insert(K, 900, 899) / 1000, 1000.0, "line 902: 0.899 s after 0.899 s; time should increase$"),
        (np.where(K == 700, 0.0, K / 1000), None, r"line 702: 0 s after 0.699 s; time should increase"),
        (
            np.sort(np.concatenate((K[:500], K[:500]))) / 1000,
            1000.0,
            "runs at 2000.* rows a second where --rate says 1000",
        ),
        (K / 1000, 500.0, "a.csv: time runs at 1000 rows a second where --rate says 500; one is wrong"),
        (np.round(K / 10_000, 3), 8000.0, "a.csv: time"),
    ],
)
def test_clock_error_names_the_row(t, rate, words):
    with pytest.raises(UserError, match=words):
        even_rows(t, rate, row)


def test_jitter_and_gaps_of_a_real_loop_are_not_a_rounded_clock():
    t = K / 1000 + JITTER
    assert even_rows(t, 1000.0, row).t is t
    lost = np.delete(t, [500, 501, 900])
    assert even_rows(lost, 1000.0, row, gaps=True).t is lost
    assert usual_step(np.diff(lost)) == pytest.approx(1e-3, rel=1e-4)


def test_small_rate_error_is_noted():
    assert (
        "time runs at 1000 rows a second and --rate says 1005: 1005 Hz is taken"
        in even_rows(K / 1000, 1005.0, row).note
    )


@pytest.mark.parametrize("unit", ["ns", "us"])
def test_time_that_cannot_be_in_seconds_needs_a_unit(tmp_path, unit):
    per_second = {"ns": 10**9, "us": 10**6}[unit]
    t = 1_700_000_000 * per_second + K * (per_second // 1000)
    table = Table(tmp_path / "a.csv", {"t": t, "u": np.sin(K), "x": np.cos(K)}, {})
    with pytest.raises(UserError, match=r"column 't' .t. has no unit, and it begins at 1.7e.* s; --unit t=ns"):
        make_bundle(table, Plan(plant="axis"), tmp_path / "b")
    made = make_bundle(table, Plan.model_validate({"plant": "axis", "columns": {"t": {"unit": unit}}}), tmp_path / "b")
    assert made.rate == 1000.0
