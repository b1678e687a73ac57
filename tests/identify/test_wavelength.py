"""Wavelengths: lines of the printer, noise without lines, and position or time origin by speed."""

import contextlib

import bench_runs as runs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.errors import NoAnswer
from rtctl.identify import scale_error as se
from rtctl.identify import wavelength as wl


def printer(speed):
    (one,) = se.passes(runs.played(se.scale_config, "ldu_printer", 0.602, speed), 0.6)
    return wl.peaks(wl.spectrum(one.x, one.e, 1200, 0.6), 3e-3)


def test_printer_has_the_wavelengths_of_the_thesis():
    peaks = printer(0.05)
    assert [round(1e3 * p.bin, 2) for p in peaks] == [300.0, 150.0, 18.75]
    assert [p.amplitude for p in peaks] == pytest.approx([8e-6, 6e-6, 5.79e-6], rel=0.02)
    assert all(p.confidence > 0.999 for p in peaks)
    turn = peaks[2]
    assert abs(turn.wavelength - 2 * np.pi * 3e-3) < 2 * turn.half
    assert turn.order == pytest.approx(1.0, abs=1e-3)


def test_printer_errors_are_functions_of_the_position():
    origins = wl.origin(printer(0.05), 0.05, printer(0.02), 0.02)
    assert [o.kind for o in origins] == ["position"] * 3


def test_dft_agrees_with_equation_11_10():
    """(11.10) term by term, with the window."""
    N, x_e = 60, 0.3
    x = x_e * np.arange(N) / N
    e = np.random.default_rng(1).standard_normal(N)
    s = wl.spectrum(np.append(x, x_e), np.append(e, e[0]), N, x_e)
    y = s.e * (0.5 - 0.5 * np.cos(2 * np.pi * np.arange(N) / N))
    for k in (1, 7, 30):
        assert s.wavelength[k - 1] == pytest.approx(x_e / k)
        assert s.E[k - 1] == pytest.approx(np.sum(y * np.exp(-2j * np.pi * x / (x_e / k))) / N)


@settings(deadline=None, max_examples=40)
@given(k=st.floats(6.0, 200.0), amplitude=st.floats(1e-6, 1e-5), phase=st.floats(-3.1, 3.1), seed=st.integers(0, 999))
def test_line_between_the_bins_is_found(k, amplitude, phase, seed):
    x = np.linspace(0, 0.6, 4000)
    noise = 2e-7 * np.random.default_rng(seed).standard_normal(4000)
    s = wl.spectrum(x, 3e-4 * x + amplitude * np.sin(2 * np.pi * k * x / 0.6 + phase) + noise)
    best = max(wl.peaks(s), key=lambda p: p.amplitude)
    assert best.wavelength == pytest.approx(0.6 / k, rel=max(2e-3, 0.02 / k))  # a 50th of a wave over the record
    assert best.amplitude == pytest.approx(amplitude, rel=0.05)


def test_noise_has_no_significant_line():
    """False alarms in 100 records of noise at a level of 99.9 %."""
    x = np.linspace(0, 0.6, 1300)
    found = 0
    for seed in range(100):
        s = wl.spectrum(x, np.random.default_rng(seed).standard_normal(1300))
        with contextlib.suppress(NoAnswer):
            found += len(wl.peaks(s)) > 0
    assert found <= 2


def line(wavelength):
    return wl.Peak(wavelength, wavelength, 1e-3 * wavelength, 1e-6, 1e-8, 0.0, 1.0, None)


def test_hum_is_a_function_of_time():
    """2 Hz is 10 mm at 20 mm/s and 25 mm at 50 mm/s; 19 mm stays."""
    slow, fast = [line(0.019), line(0.010)], [line(0.019), line(0.025)]
    assert [o.kind for o in wl.origin(slow, 0.02, fast, 0.05)] == ["position", "time"]
    assert wl.origin(slow, 0.02, fast, 0.05)[1].frequency == pytest.approx(2.0)
    assert wl.origin([line(0.1)], 0.02, fast, 0.05)[0].kind == "neither"
    assert wl.origin([line(0.010)], 0.02, [line(0.010), line(0.025)], 0.05)[0].kind == "either"
    with pytest.raises(NoAnswer, match="too alike"):
        wl.origin(slow, 0.02, fast, 0.021)


def test_short_records_are_refused():
    x = np.linspace(0, 0.3, 2000)
    with pytest.raises(NoAnswer, match=r"covers 300\.0 mm; the analysis is over 600\.0 mm"):
        wl.spectrum(x, 0 * x, 1200, 0.6)
    with pytest.raises(NoAnswer, match="2000 samples"):
        wl.spectrum(x, 0 * x, 4000)
