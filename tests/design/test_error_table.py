"""Error tables from a scale or an image; the table corrects the capstan's periodic error in the emulator."""

from typing import NamedTuple

import filters
import fused
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.errors import NoAnswer
from rtctl.config.load import set_path
from rtctl.design import error_table
from rtctl.identify import luminance
from rtctl.laws import error_table as law

PERIOD = 2 * np.pi * 3e-3
TERMS = [
    {"term": "ripple.encoder", "node": "encoder", "A": 1e-3, "phi": 0.4, "A2": 2e-4, "phi2": 1.0},
    {"term": "ripple.capstan", "node": "capstan", "a": 2e-6, "phi": -0.7},
]


class Moved(NamedTuple):
    """240 mm at 40 mm/s after the transient; the loop of 50 Hz is closed on the corrected estimate."""

    x: np.ndarray  # m, by the encoder
    estimate: np.ndarray  # m, scale - corrected position
    tracking: np.ndarray  # m, scale - reference


def moved(values: list[float]) -> Moved:
    config = fused.config("ldu", plant__physics=TERMS, law__shaper__bandwidth=None)
    for path, value in {
        "law.position": {"kind": "sections", **filters.FIFTY_HERTZ},
        "reference": {"steps": [{"at": 0.2, "to": 0.33, "ramp": 0.04}]},
        "sensors.correction": {"period": PERIOD, "values": values},
    }.items():
        config = set_path(config, path, value)
    run = fused.run(config, 8.6)
    assert not run.tripped
    rows = run.between(2.4, 8.4)[::10]
    x = rows["encoder_counts"] * (2 * np.pi / 20_000) * 3e-3
    return Moved(x, rows["scale"] - rows["position"], rows["scale"] - rows["ref"])


@pytest.fixture(scope="module")
def plain() -> Moved:
    return moved([0.0, 0.0])


def test_table_from_the_scale_removes_nine_tenths_of_the_periodic_error(plain):
    """11.3: encoder, coupling and capstan together, from the scale; the carriage follows its reference."""
    table = error_table.from_scale(plain.x, plain.estimate, PERIOD)
    put_right = moved(table.settings.values)
    for before, after in ((plain.estimate, put_right.estimate), (plain.tracking, put_right.tracking)):
        size = error_table.periodic(plain.x, before, PERIOD)
        assert size > 1.5e-6
        assert error_table.periodic(put_right.x, after, PERIOD) < 0.1 * size


def test_table_from_an_image_removes_nine_tenths_of_the_periodic_error():
    """(11.11): luminance of an image; the response from error to luminance is from another record."""
    x = np.arange(0.0, 0.6, 1e-4)
    e = 2.75e-6 * np.sin(2 * np.pi * x / PERIOD - 0.8)
    known = 3e-6 * np.sin(2 * np.pi * x / PERIOD + 0.3)
    quiet = {"drift": 0.05, "noise": 0.02}
    images = [luminance.printed(x, y, luminance.PrintSettings(seed=s, **quiet)) for s, y in ((1, e), (2, known))]
    gain = error_table.luminance_gain(images[1].x, images[1].L, np.interp(images[1].x, x, known), PERIOD)
    table = error_table.from_luminance(images[0].x, images[0].L, PERIOD, gain)
    p = law.build(table.settings, 1e-4)
    left = e + x - np.array([law.step(p, v) for v in x])
    assert error_table.periodic(x, left, PERIOD, 1) < 0.1 * error_table.periodic(x, e, PERIOD, 1)


@settings(deadline=None, max_examples=40)
@given(st.floats(1e-6, 1e-5), st.floats(0, 6.28), st.floats(-1e-3, 1e-3))
def test_amplitude_and_trend_are_found(a, phi, slope):
    x = np.linspace(0, 10 * PERIOD, 5000)
    rng = np.random.default_rng(1)
    e = a * np.sin(2 * np.pi * x / PERIOD + phi) + slope * x + 1e-7 * rng.standard_normal(len(x))
    table = error_table.from_scale(x, e, PERIOD)
    assert table.amplitude[0] == pytest.approx(a, rel=0.03)
    assert table.trend == pytest.approx(slope, abs=2e-6)
    wanted = a * np.sin(2 * np.pi * np.arange(64) / 64 + phi)
    np.testing.assert_allclose(table.settings.values, wanted, atol=0.05 * a)


def test_waves_of_the_guide_stay_out_of_the_table():
    """Waves of 150 and 300 mm are those of the guide strip, not of the capstan."""
    x = np.linspace(0, 0.6, 20_000)
    capstan = 3e-6 * np.sin(2 * np.pi * x / PERIOD)
    guide = 2e-6 * np.sin(2 * np.pi * x / 0.15) + 3e-6 * np.cos(2 * np.pi * x / 0.3)
    table = error_table.from_scale(x, capstan + guide, PERIOD)
    assert table.amplitude[0] == pytest.approx(3e-6, rel=0.03)
    assert (table.amplitude[1:] < 0.03 * 3e-6).all()


@pytest.mark.parametrize(("x", "e", "words"), [
    (np.linspace(0, 2 * PERIOD, 999), np.zeros(999), "covers 2 turns"),
    (np.round(np.linspace(0, 9, 999)) * PERIOD, np.zeros(999), "no sample near"),
    (np.linspace(0, 9 * PERIOD, 999), 1e-6 * np.random.default_rng(0).standard_normal(999), "nothing comes back"),
], ids=["short", "steps", "noise"])  # fmt: skip
def test_record_without_a_periodic_error_gives_no_table(x, e, words):
    with pytest.raises(NoAnswer, match=words):
        error_table.from_scale(x, e, PERIOD)


@pytest.mark.parametrize(("turns", "wave", "words"), [(5, 1.0, "5 turns"), (30, 0.0, "does not stand out")])
def test_image_without_the_periodic_error_gives_no_table(turns, wave, words):
    x = np.linspace(0, turns * PERIOD, 4000)
    L = 50 + wave * np.sin(2 * np.pi * x / PERIOD) + np.random.default_rng(3).standard_normal(4000)
    with pytest.raises(NoAnswer, match=words):
        error_table.from_luminance(x, L, PERIOD, 1e5)


def test_image_with_uneven_positions_is_refused():
    x = np.linspace(0, 1, 4000) ** 2
    with pytest.raises(NoAnswer, match="evenly"):
        error_table.from_luminance(x, x, PERIOD, 1e5)
