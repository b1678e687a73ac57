import numpy as np
import pytest
from pydantic import TypeAdapter

from rtctl.laws import excitation

DT = 0.002
ADAPTER = TypeAdapter(excitation.ExcitationSettings)


def built(**choices):
    return excitation.build(ADAPTER.validate_python(choices), DT)


def play(p, ticks):
    return np.array([excitation.step(p, k) for k in ticks])


NOISE = {"kind": "noise", "rms": 0.5, "f_min": 1.0, "f_max": 100.0}
MULTISINE = {"kind": "multisine", "rms": 0.5, "f_min": 1.0, "f_max": 100.0}


def test_excitation_none_is_zero():
    assert np.all(play(built(kind="none"), range(20)) == 0.0)


@pytest.mark.parametrize("choices", [NOISE, MULTISINE])
def test_excitation_has_the_requested_rms_and_band(choices):
    p = built(**choices)
    w = play(p, range(p.n))
    spectrum = np.abs(np.fft.rfft(w)) / p.n
    f = np.fft.rfftfreq(p.n, DT)
    assert np.sqrt(np.mean(w**2)) == pytest.approx(0.5)
    assert spectrum[(f < 0.99) | (f > 100.01)].max() < 1e-12
    assert spectrum[(f > 1) & (f < 100)].max() > 1e-3


def test_multisine_has_equal_odd_lines_only():
    p = built(**MULTISINE)
    lines = np.abs(np.fft.rfft(p.x[: p.n]))
    used = lines > 1e-6
    assert np.all(np.flatnonzero(used) % 2 == 1)
    assert lines[used] == pytest.approx(np.full(used.sum(), lines[used][0]))


@pytest.mark.parametrize("choices", [NOISE, MULTISINE, {"kind": "prbs", "amplitude": 1.0}])
def test_seed_determines_the_excitation(choices):
    one, same, other = built(**choices), built(**choices), built(**choices, seed=2)
    assert np.array_equal(one.x, same.x)
    assert not np.array_equal(one.x, other.x)


def test_prbs_is_white_and_two_valued():
    p = built(kind="prbs", amplitude=2.0, hold=3)
    w = play(p, range(p.n))
    assert set(w) == {2.0, -2.0}
    bits = w[::3] / 2
    assert p.n == 3 * len(bits) and p.n <= 2000
    correlation = np.fft.ifft(np.abs(np.fft.fft(bits)) ** 2).real
    assert correlation[1:] == pytest.approx(np.full(len(bits) - 1, -1.0), abs=1e-6)


@pytest.mark.parametrize("f", [1.0, 7.3, 0.123, 61.7])
def test_sine_has_its_frequency_and_repeats_without_a_step(f):
    p = built(kind="sine", amplitude=1.5, frequency=f)
    k = np.arange(min(p.n, 5000))
    assert p.amplitude * p.x[k] == pytest.approx(1.5 * np.sin(2 * np.pi * f * k * DT), abs=0.02)
    assert excitation.step(p, p.n) == excitation.step(p, 0)


def test_excitation_repeats_between_start_and_stop_only():
    p = built(**NOISE, start="0.1 s", stop="8.1 s")
    assert p.n == 2000
    ticks = play(p, [49, 50, 2050, 4049, 4050, 10**9])
    assert ticks[0] == ticks[4] == ticks[5] == 0.0
    assert ticks[1] == ticks[2] == 0.5 * p.x[0]
    assert ticks[3] == 0.5 * p.x[1999]


def test_excitation_reads_its_parameters_from_a_record(record):
    p = built(**NOISE)
    assert excitation.step(record(p), 123) == excitation.step(p, 123)


@pytest.mark.parametrize(
    ("choices", "words"),
    [
        ({**NOISE, "period": 1000.0}, "65536 are the most"),
        ({**NOISE, "f_max": 300.0}, "not below half the sample rate of 500 Hz"),
        ({**MULTISINE, "f_min": 99.9, "f_max": 99.95}, "no line"),
        ({"kind": "prbs", "amplitude": 1.0, "hold": 900}, "no room"),
        ({"kind": "sine", "amplitude": 1.0, "frequency": 250.0}, "250 Hz is not between"),
    ],
)
def test_excitation_that_does_not_fit_the_sample_rate_is_refused(choices, words):
    with pytest.raises(ValueError, match=words):
        built(**choices)
