"""Model fit: parameters of the emulator, coverage of the intervals, and refusal of uninformative data."""

from functools import lru_cache

import frf_runs
import numpy as np
import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.identify import best_linear, model_fit, sensitivity
from rtctl.identify.frf import Frf

BELIEVED = {"J_m": 1.5e-3, "c": 450.0, "k": 12.5, "c_m": 12.0, "k_m": 1.3e-2}


def unknown(seed: int, sides: tuple[str, ...] = ("",)) -> dict[str, float]:
    """Parameters within 30 % of the nominal values; separate values for the named `sides`."""
    rng = np.random.default_rng(seed)
    return {name + side: value * rng.uniform(0.7, 1.3) for name, value in BELIEVED.items() for side in sides}


@lru_cache(maxsize=8)
def played(seed: int, R1: float = 0.038, R2: float = 0.022, motor: int = 1, alike: bool = True) -> Frf:
    truth = unknown(seed) if alike else unknown(seed, ("1", "2"))
    both = {name + side: value for name, value in truth.items() for side in ("1", "2")} if alike else truth
    return best_linear.identify(frf_runs.play(frf_runs.reels(R1, R2, **both), motor=motor)).frf


@pytest.mark.parametrize("seed", [2, 3, 5])
def test_parameters_within_30_percent_are_identified_within_5_percent(seed):
    frf, truth = played(seed), unknown(seed)
    found = model_fit.fit(frf, frf_runs.config())
    both = {name + side: value for name, value in truth.items() for side in ("1", "2")}
    K_p = model_fit.process_gain(frf_runs.reels(0.038, 0.022, **both), frf)
    for name, true in {"K_p": K_p, **{key: truth[key] for key in ("c", "c_m", "k_m", "J_m")}}.items():
        e = found.K_p if name == "K_p" else found.parameters[name]
        assert e.value == pytest.approx(true, rel=0.05), name
        assert e.low < true < e.high, name
        assert e.high / e.low < 1.1, name
    assert found.tau.low < 0.003 < found.tau.high  # 8.2
    assert 0.5 < found.chi2 < 1.5


def test_fitted_process_gain_is_that_of_the_thesis():
    found = model_fit.fit(frf_runs.response().frf, frf_runs.config())
    assert found.K_p.value == pytest.approx(25.4, rel=0.03)
    assert found.K_p.unit == "rad/s^2/A"
    assert found.parameters["c_m"].unit == "Nm/rad"
    assert found.settings.parameters.c_m1 == found.parameters["c_m"].value


def test_fit_from_noise_excitation():
    found = model_fit.fit(sensitivity.identify(frf_runs.noise()).frf, frf_runs.config())
    for name, true in BELIEVED.items():
        assert found.parameters[name].value == pytest.approx(true, rel=0.05), name


def test_fit_does_not_depend_on_the_division_by_the_drive():
    frf, config = frf_runs.response().frf, frf_runs.config()
    one, two = model_fit.fit(frf, config), model_fit.fit(frf.without_drive(config), config)
    assert two.parameters["J_m"].value == pytest.approx(one.parameters["J_m"].value, rel=1e-5)


def test_different_sides_need_separate_parameters():
    """Common parameters do not fit the data; both motors at two pairs of radii identify all ten."""
    truth = unknown(2, ("1", "2"))
    frfs = [played(2, R1, R2, motor, False) for R1, R2 in ((0.038, 0.022), (0.03, 0.03)) for motor in (1, 2)]
    with pytest.raises(NoAnswer, match=r"misfit is .* times the noise, worst from .* two sides are not alike"):
        model_fit.fit(frfs, frf_runs.config())
    found = model_fit.fit(frfs, frf_runs.config(), free=model_fit.EACH)
    for name in model_fit.EACH:
        assert found.parameters[name].value == pytest.approx(truth[name], rel=0.06), name
    inside = [e.low < truth[name] < e.high for name, e in found.parameters.items()]
    assert sum(inside) >= 8


def test_linear_drive_is_fitted():
    hidden = {"J_m": 1.2e-6, "M": 1.4, "k_c": 8.6, "b_c": 7e-4}
    frf = best_linear.identify(frf_runs.play(frf_runs.config("ldu", plant__parameters=hidden))).frf
    found = model_fit.fit(frf, frf_runs.config("ldu"))
    for name, true in hidden.items():
        e = found.parameters[name]
        assert e.value == pytest.approx(true, rel=0.05), name
        deviation = np.log(e.high / e.low) / 4  # one interval in twenty misses the truth
        assert abs(np.log(e.value / true)) < 3 * deviation, name
    with pytest.raises(NoAnswer, match=r"k_s runs to|does not determine k_s"):  # mode at 2.1 kHz
        model_fit.fit(frf, frf_runs.config("ldu"), free=(*hidden, "k_s", "b_s"))


def test_linear_drive_with_reversing_friction_is_refused():
    """Little damping and a light motor: the vibration speed exceeds the constant speed."""
    light = {"J_m": 7.8e-7, "M": 1.25, "k_c": 8.1, "b_c": 5.9e-4}
    with pytest.raises(NoAnswer, match="the machine reverses"):
        best_linear.identify(frf_runs.play(frf_runs.config("ldu", plant__parameters=light), realisations=2))


def test_band_without_the_mode_does_not_identify_its_damping():
    with pytest.raises(NoAnswer, match=r"(does not determine|runs to|does not separate).*"):
        model_fit.fit(frf_runs.response().frf, frf_runs.config(), band=(0.4, 8.0))
    with pytest.raises(NoAnswer, match=r"\d lines of the response are accurate enough from 1 to 2 Hz"):
        model_fit.fit(frf_runs.response().frf, frf_runs.config(), band=(1.0, 2.0))


def test_delay_can_be_given():
    found = model_fit.fit(frf_runs.response().frf, frf_runs.config(), tau=0.003)
    assert found.tau.value == 0.003 and found.correlation.shape == (5, 5)


@pytest.mark.parametrize(
    "free, said",
    [
        (("J_n",), r"no parameter 'J_n'; did you mean 'J_"),
        (("c", "c1"), "name each parameter once"),
        ((), "at least one"),
    ],
)
def test_invalid_parameter_names_are_refused(free, said):
    with pytest.raises(UserError, match=said):
        model_fit.fit(frf_runs.response().frf, frf_runs.config(), free=free)


def test_response_of_another_machine_is_refused():
    with pytest.raises(UserError, match="must be of an ldu"):
        model_fit.fit(frf_runs.response().frf, frf_runs.config("ldu"))
    with pytest.raises(UserError, match="not for axis"):
        model_fit.fit(frf_runs.response().frf, frf_runs.config("axis"))
