"""Fit of the plant model to a measured response, weighted by the accuracy of magnitude and phase.

    minimise sum over lines of |ln(H / H_model)|^2 / (sd / |H|)^2          real part magnitude, imaginary part phase
    H_model = P(j w; parameters) (1 - e^(-j w T)) / (j w T) e^(-j w (tau - T/2))          tau = T_s/2 + T_c    (8.2)

P is `state_space` of the plant with the given parameters. The logarithm weights errors of magnitude and of phase
equally and has no bias for a circular error. Parameters are fitted by their logarithm: they stay positive and their
intervals are factors. The covariance is (J^T J)^-1. It grows by the chi-square per line where the misfit exceeds the
noise, and by an error of 0.1 % common to all lines (rounding of the encoder is no noise). The interval is the deviation
times Student's t and covers 95 %.

Parameters of the reel unit from the capstan angle, with one driving motor: J_m from the level, with known K_m and
radii; c and k of the tape from the decoupling of the far reel at 1.9 Hz; c_m and k_m from the mode at 41 Hz, where reel
1 (its inertia from its radius, 4.1) swings between its shaft and the tape. The reel sensors are not needed. Both sides
are assumed equal, as in the thesis (c_1 = c_2 and so on). K_m and J_m together are ill-conditioned: the level gives
their ratio, and only the known inertia of the reel separates them, to some 5 %.

Where the sides are not equal, this model does not explain the response, and the fit refuses (`MISFIT`). All ten
parameters of the two sides (`EACH`) need responses of both motors at two pairs of radii, say 38/22 and 30/30 mm. For
each motor its own reel is the near one. An empty reel (8e-6 kg m^2) has its shaft mode at 190 Hz, out of the band.

The linear drive is a mass-damper up to 50 Hz. Its level is mostly the motor behind its transmission: J_m N^2 / R_c^2 =
44 kg beside a carriage of 1.25 kg. M, k_c and b_c come from the mode at 119 Hz. The mode of k_s and b_s is at 2.1 kHz,
and the fit refuses them.

Source: thesis 8.1, 8.2, 12.3; Pintelon & Schoukens, System Identification (2012), chapter 9.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer, UserError, nearest
from rtctl.identify.frf import Frf
from rtctl.identify.model import Model, keys, process_gain
from rtctl.machines.ivu_profile import EACH
from rtctl.machines.profile import Response
from rtctl.machines.profiles import PROFILES, profile_of

__all__ = ["EACH", "FREE", "Estimate", "Fit", "fit", "process_gain"]

FREE = {kind: profile.response.free for kind, profile in PROFILES.items() if profile.response is not None}
SPAN = 8.0  # limit of a parameter as a factor of its start value
VAGUE = 1.0  # logarithm: an interval wider than a factor of e each way is refused
MISFIT = 2.0  # chi-square per degree of freedom above which the model is rejected
COMMON = 1e-3  # relative deviation common to all lines: encoder rounding turns H of the ldu by 1 to 3 mrad
STEP = 1e-4  # logarithm, step of a finite difference
STARTS, AROUND = 8, 0.35  # further starts of the fit, and their distance from the model in logarithms


class Estimate(NamedTuple):
    value: float
    low: float  # lower limit of the 95 % interval
    high: float
    unit: str


class Fit(NamedTuple):
    parameters: dict[str, Estimate]
    tau: Estimate  # s, delay including the hold (8.2)
    K_p: Estimate  # |H| (2 pi f)^2 at 1 Hz, rad/s^2 per A or m/s^2 per A, of the first response
    chi2: float  # chi-square per degree of freedom; 1 where the residual is noise
    lines: int
    band: tuple[float, float]  # Hz
    correlation: np.ndarray  # (m, m) of the logarithms, tau last
    settings: Any  # settings of the plant with the fitted parameters
    frfs: tuple[Frf, ...]
    models: tuple[np.ndarray, ...]  # response of the model at the lines of each measured response


def fit(
    frfs: Frf | Sequence[Frf],
    config: Any,
    free: Sequence[str] | None = None,
    band: tuple[float, float] | None = None,
    tau: float | None = None,
) -> Fit:
    """Fit the model of `config.plant`, the start of the search, to one or more responses at their reel radii.

    `free` names parameters (one name for both sides of the reel unit: J_m, c, k, c_m, k_m). `band` is in Hz. `tau` in s
    is also fitted where it is None. Raises UserError for an unknown parameter. Raises NoAnswer where the lines do not
    determine the parameters: too few lines, or an interval wider than a factor of 2.7 each way.
    """
    from scipy.stats import t as student

    given = (frfs,) if isinstance(frfs, Frf) else tuple(frfs)
    names = tuple(FREE.get(config.kind, ()) if free is None else free)
    _check(given, config, names)
    bottom, top = band or _response(config).band
    kept = tuple(frf.select((frf.f >= bottom) & (frf.f <= top) & (frf.relative < 0.5)) for frf in given)
    lines = sum(len(frf.f) for frf in kept)
    if 2 * lines < 3 * (len(names) + 1):
        raise NoAnswer(
            f"{lines} lines of the response are accurate enough from {bottom:g} to {top:g} Hz; {len(names) + 1} "
            f"parameters need {int(np.ceil(1.5 * (len(names) + 1)))} at least"
        )
    model = Model(config, names)
    dt = kept[0].dt
    tau_0 = dt * (0.5 + (config.loop.write == "next_tick"))
    start = np.log([model.start[name] for name in names] + ([tau_0] if tau is None else []))

    def predicted(x: np.ndarray) -> list[np.ndarray]:
        values = dict(zip(names, np.exp(x[: len(names)]), strict=True))
        late = float(np.exp(x[-1])) if tau is None else tau
        return [model.response(values, frf, late) for frf in kept]

    def misfit(x: np.ndarray) -> np.ndarray:
        parts = []
        for frf, H in zip(kept, predicted(x), strict=True):
            off = np.log(frf.H / H) * (np.sqrt(2 / frf.inflation) / frf.relative)
            parts += [off.real, off.imag]
        return np.concatenate(parts)

    span = np.log(SPAN)
    found = _best(misfit, start, span)
    freedom = 2 * lines - len(start)
    chi2 = 2 * found.cost / freedom * kept[0].inflation
    if chi2 > MISFIT:
        raise NoAnswer(_misfit(kept, predicted(found.x), chi2, config))
    weights = np.concatenate([np.sqrt(2 / frf.inflation) / frf.relative for frf in kept])
    alone = _covariance(found.jac, names, tau is None)
    covariance = alone * max(chi2, 1.0) + _common(found.jac, alone, [len(frf.f) for frf in kept], weights)
    wide = float(student.ppf(0.975, freedom)) * np.sqrt(np.diag(covariance))
    _check_known(found.x, start, wide, names, span, (bottom, top))
    units = _units(config, names)

    def estimate(i: int, unit: str) -> Estimate:
        value, low, high = (float(np.exp(found.x[i] + side * wide[i])) for side in (0, -1, 1))
        return Estimate(value, low, high, unit)

    parameters = {name: estimate(i, units[name]) for i, name in enumerate(names)}
    values = {name: e.value for name, e in parameters.items()}
    late = Estimate(tau, tau, tau, "s") if tau is not None else estimate(len(names), "s")
    deviation = np.sqrt(np.diag(covariance))
    return Fit(
        parameters, late, _process_gain(model, kept[0], values, found.x, covariance, wide, deviation), float(chi2),
        lines, (bottom, top), covariance / np.outer(deviation, deviation), model.settings(values), kept,
        tuple(predicted(found.x)),
    )  # fmt: skip


def _check(frfs: tuple[Frf, ...], config: Any, names: Sequence[str]) -> None:
    if config.kind not in FREE:
        raise UserError(f"{config.name}: a response is fitted for {' and '.join(FREE)}, not for {config.kind}")
    known = type(config.plant.parameters).model_fields
    for name in names:
        if not all(key in known for key in keys(config.kind, name)):
            choices = [*known, *profile_of(config.kind).pairs]
            near = nearest(name, choices)
            raise UserError(f"free: the {config.kind} has no parameter '{name}'"
                            + (f"; did you mean '{near}'?" if near else ""))  # fmt: skip
    meant = [key for name in names for key in keys(config.kind, name)]
    if len(set(meant)) < len(meant) or not names:
        raise UserError(f"free: {', '.join(names) or 'nothing'}: name each parameter once, and at least one")
    if not frfs or any(frf.kind != config.kind or frf.dt != frfs[0].dt for frf in frfs):
        raise UserError(f"{config.name}: the responses must be of an {config.kind}, all at one rate")


def _response(config: Any) -> Response:
    found = profile_of(config.kind).response
    assert found is not None
    return found


def _best(misfit: Callable[[np.ndarray], np.ndarray], start: np.ndarray, span: float) -> Any:
    """Least squares from the model and from STARTS points around it: a resonance gives several local minima."""
    from scipy.optimize import least_squares

    around = np.random.default_rng(0).uniform(-AROUND, AROUND, (STARTS, len(start)))

    def jacobian(x: np.ndarray) -> np.ndarray:
        """Jacobian by central differences, with a step above the rounding errors of a stiff plant."""
        steps = STEP * np.eye(len(x))
        return np.stack([(misfit(x + h) - misfit(x - h)) / (2 * STEP) for h in steps], axis=1)

    options: dict[str, Any] = {"jac": jacobian, "bounds": (start - span, start + span), "x_scale": 0.1}
    tries = [least_squares(misfit, start + off, **options) for off in (0 * start, *around)]
    best = min(tries, key=lambda one: float(one.cost))
    return least_squares(misfit, best.x, xtol=1e-11, ftol=1e-11, **options)


def _misfit(frfs: tuple[Frf, ...], models: list[np.ndarray], chi2: float, config: Any) -> str:
    off = [np.abs(np.log(frf.H / H)) / frf.relative for frf, H in zip(frfs, models, strict=True)]
    worst = max(range(len(off)), key=lambda i: float(off[i].max()))
    f = frfs[worst].f[off[worst] > 0.5 * off[worst].max()]
    hint = ""
    if each := _response(config).each:
        hint = "; where the two sides are not alike, give responses of both motors at two pairs of radii and free "
        hint += ", ".join(each)
    return (
        f"the model does not explain the response: its misfit is {np.sqrt(chi2):.3g} times the noise, worst from "
        f"{f.min():.3g} to {f.max():.3g} Hz{hint}"
    )


def _covariance(J: np.ndarray, names: Sequence[str], late: bool) -> np.ndarray:
    """Covariance (J^T J)^-1. Raises NoAnswer with the parameters of an undetermined combination."""
    _, s, V = np.linalg.svd(J, full_matrices=False)
    if s[-1] < 1e-9 * s[0]:
        every = (*names, "tau") if late else tuple(names)
        mixed = [name for name, part in zip(every, V[-1], strict=True) if abs(part) > 0.3]
        raise NoAnswer(f"the response does not separate {' and '.join(mixed)}; fix one of them")
    return (V.T / s**2) @ V


def _common(J: np.ndarray, alone: np.ndarray, counts: list[int], weights: np.ndarray) -> np.ndarray:
    """Covariance by a common error of COMMON in the magnitude of all lines, and one in their phase."""
    ends = np.cumsum([0, *counts])
    total = np.zeros_like(alone)
    for part in (0, 1):
        r = np.concatenate(
            [np.concatenate([(i == part) * COMMON * weights[a:b] for i in (0, 1)]) for a, b in pairwise(ends)]
        )
        shift = alone @ J.T @ r
        total += np.outer(shift, shift)
    return total


def _check_known(
    x: np.ndarray, start: np.ndarray, wide: np.ndarray, names: Sequence[str], span: float, band: tuple[float, float]
) -> None:
    for i, name in enumerate((*names, "tau")[: len(x)]):
        if abs(x[i] - start[i]) > 0.99 * span:
            raise NoAnswer(
                f"{name} runs to {np.exp(x[i]):.3g}, a factor of {SPAN:g} off the model; the response from "
                f"{band[0]:g} to {band[1]:g} Hz does not determine it, or the model is wrong"
            )
        if wide[i] > VAGUE:
            raise NoAnswer(
                f"the response from {band[0]:g} to {band[1]:g} Hz does not determine {name}: {np.exp(x[i]):.3g} within "
                f"a factor of {np.exp(wide[i]):.2g}; widen the band, measure longer, or leave it out"
            )


def _units(config: Any, names: Sequence[str]) -> dict[str, str]:
    fields = type(config.plant.parameters).model_fields
    return {n: (fields[keys(config.kind, n)[0]].json_schema_extra or {}).get("unit", "") for n in names}


def _process_gain(
    model: Model, frf: Frf, values: dict[str, float], x: np.ndarray, covariance: np.ndarray, wide: Any, deviation: Any
) -> Estimate:
    """Process gain at 1 Hz, with the interval by the covariance of the parameters."""
    K = model.process_gain(values, frf)
    slope = np.zeros(len(x))
    for i, name in enumerate(values):
        more = {**values, name: values[name] * 1.001}
        slope[i] = np.log(model.process_gain(more, frf) / K) / np.log(1.001)
    half = float(wide[0] / deviation[0]) * float(np.sqrt(slope @ covariance @ slope))
    return Estimate(K, float(K * np.exp(-half)), float(K * np.exp(half)), f"{profile_of(frf.kind).unit}/s^2/A")
