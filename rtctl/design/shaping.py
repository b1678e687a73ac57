"""Loop shaping: lead-lag, two notches and a low-pass, found by optimisation under limits on the margins.

    K = H_l H_n1 H_n2 H_lp        largest bandwidth with GM >= GM_min, PM >= PM_min, |S| <= S_max

The plant is a frequency response, identified or of a model; no structure of the plant is assumed. The filters are the
sampled sections of the tick, and the loop includes hold and delay. The optimiser varies the gain, the lead (middle and
width), both notches (frequency, depth, width) and the corner of the low-pass. The lag stays at a fixed ratio below the
lead, where it costs 1 degree at the cross-over (12.7).

Source: thesis 12.7, (12.4), (12.5), figure 12.9. Storn & Price, Differential evolution, J. Global Optimization 11
(1997), with fixed seeds, and then Nelder & Mead, Computer Journal 7 (1965): margins have corners, not gradients.
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.design import margins, response
from rtctl.design.margins import Margins
from rtctl.laws import sections
from rtctl.laws.sections import SectionsSettings


class Slack(NamedTuple):
    """Reserve beyond the limits, since the grid of the optimiser is coarser than that of the final check."""

    GM: float  # dB
    PM: float  # deg
    M_S: float  # dB
    bandwidth: float  # share


LAG_BELOW = 40.0  # the lag ends this factor below the middle of the lead
LAG_RATIO = 0.05  # alpha: 26 dB more gain at rest
SEARCHES = ((1, 1.0), (2, 0.3), (3, 0.0))  # seed, and share of the slack; one after the other until the limits are met
GENERATIONS, POPULATION, EDGE = 200, 12, 1.5
ROUNDS, EVALUATIONS = 2, 1500
SLACK = Slack(0.2, 0.5, 0.1, 0.005)
WEIGHT = 10.0  # of a missed limit against the logarithm of the bandwidth
NEAR = np.radians(3.0)  # rad from the negative real axis within which a point of the grid counts as a crossing
AWAY = (5.0, 11.0)  # dB that a resonance must stay below |L| = 1, and the gain margin that this distance counts as
RISE = 1.25  # of a resonance above the gain before it
LOWEST = 30.0  # dB below a mass, from which on a resonance is ignored
SAMPLES = 500  # of a response that a model gives, and 80 more at every resonance
HIGHEST = 0.45  # of the sample rate, for any corner of a filter
LEAST_DEPTH = 0.03  # gain of a notch at its frequency, at least: a resonance moves by a percent
BOUNDS = {  # of the optimiser's variables, as factors of their first values
    "gain": (0.05, 20.0),
    "cross": (0.3, 3.0),  # Hz, middle of the lead
    "beta": (0.2, 7.0),
    "frequency": (0.85, 1.15),
    "corner": (0.2, 4.0),
}


class Limits(NamedTuple):
    """Limits on margins, sensitivity and bandwidth of the loop."""

    GM: float = 11.0  # dB
    PM: float = 60.0  # deg
    M_S: float = 6.0  # dB, largest |S|
    bandwidth: float = 50.0  # Hz


class Shaped(NamedTuple):
    """Filters, and the margins of their loop on the response that was given."""

    law: SectionsSettings
    margins: Margins


def design(config: Any, limits: Limits | None = None) -> Shaped:
    """Filters for the plant model of a config, at its sample rate. Raises NoAnswer where the limits cannot be met."""
    parts = response.take(config)
    high = margins.HIGH / parts.dt
    f = np.geomspace(0.5, high, SAMPLES)
    peaks = resonances(f, response.plant_response(parts.model, f))
    f = np.unique(np.concatenate([f, *(np.geomspace(0.8, 1.25, 80) * peak for peak in peaks)]))
    f = f[f <= high]
    return of_points(f, response.plant_response(parts.model, f), parts.dt, parts.delay, limits)


def of_points(f: np.ndarray, P: np.ndarray, dt: float, delay: int | None = 1, limits: Limits | None = None) -> Shaped:
    """Filters for a plant response `P` (n,), m or rad per V, known at `f` (n,) Hz, for ticks of `dt` s.

    `delay` is the number of ticks until a command is written; None where hold and delay are in `P` already, as in a
    response between recorded columns. Raises NoAnswer where the limits cannot be met, and says how far they are.
    """
    from scipy.optimize import differential_evolution, minimize  # slow to import, and needed here only

    limits = limits or Limits()
    use = f < margins.HIGH / dt
    f, P = np.asarray(f, float)[use], np.asarray(P)[use]
    if f[0] > limits.bandwidth / 10 or f[-1] < 3 * limits.bandwidth:
        raise NoAnswer(
            f"the response runs from {f[0]:g} to {f[-1]:g} Hz; shaping for {limits.bandwidth:g} Hz takes one from "
            f"{limits.bandwidth / 10:g} to {3 * limits.bandwidth:g} Hz"
        )
    s = 2j * np.pi * f
    H = P if delay is None else P * -np.expm1(-s * dt) / (s * dt) * np.exp(-s * dt * delay)
    box = _box(f, P, limits, dt)

    def cost(x: np.ndarray, slack: Slack) -> float:
        values = _unfold(x, box)
        if values[1] * np.sqrt(values[2]) > HIGHEST / dt:  # where the lead ends
            return 1e3
        L = H * _filters(values, f, dt)
        try:
            m = margins.points(f, L)
        except NoAnswer:
            return 1e3
        if not m.stable:
            return 1e2 + max(-m.GM, 0.0)
        bandwidth = m.bandwidth if np.isfinite(m.bandwidth) else f[-1]
        m = m._replace(GM=_gain_margin(L))
        return -np.log(bandwidth) + WEIGHT * float(np.sum(_missing(m, limits, slack)))

    least, size = np.inf, {"maxiter": GENERATIONS, "popsize": POPULATION}
    for seed, share in SEARCHES:
        slack = Slack(*(share * value for value in SLACK))
        box_x = [(-EDGE, EDGE)] * len(box)
        x = differential_evolution(cost, box_x, (slack,), seed=seed, polish=False, **size).x
        for _ in range(ROUNDS):
            found = minimize(cost, x, (slack,), "Nelder-Mead", options={"maxfev": EVALUATIONS, "adaptive": True})
            x = found.x
        if found.fun < least:
            least, best = found.fun, _reached(f, H, _unfold(x, box), dt)
        if best.margins.stable and not np.any(_missing(best.margins, limits) > 0):
            return best
    m = best.margins
    raise NoAnswer(
        f"the limits cannot be met: {m.bandwidth:.3g} Hz with {m.GM:.3g} dB, {m.PM:.3g} deg and |S| up to "
        f"{m.M_S:.3g} dB is what was found, for {limits.bandwidth:g} Hz, {limits.GM:g} dB, {limits.PM:g} deg and "
        f"{limits.M_S:g} dB"
    )


def _reached(f: np.ndarray, H: np.ndarray, x: np.ndarray, dt: float) -> Shaped:
    """Filters for the values `x`, and the margins of their sampled sections."""
    law, back = _settings(x, dt), np.exp(-2j * np.pi * f * dt)
    K = np.prod([response.biquad_response(p, back) for p in sections.build(law, dt)], axis=0)
    return Shaped(law, margins.points(f, H * K))


def applied(config: Any, law: SectionsSettings) -> Any:
    """The config with these filters for its position law."""
    from rtctl.config.load import set_path

    return set_path(config, "law.position", {"kind": "sections", **law.model_dump(exclude_unset=True)})


def resonances(f: np.ndarray, P: np.ndarray) -> list[float]:
    """Frequencies in Hz of the two resonances that stand out most from the slope of a mass, rising."""
    from scipy.signal import find_peaks  # slow to import, and needed here only

    height = 20 * np.log10(np.abs(P) * f**2)
    at, about = find_peaks(height, prominence=0.5, height=height[: len(height) // 8].mean() - LOWEST)
    most = at[np.argsort(about["prominences"])[::-1][:2]]
    return sorted(float(x) for x in f[most])


def _box(f: np.ndarray, P: np.ndarray, limits: Limits, dt: float) -> np.ndarray:
    """Logarithms (10, 3) of least, first and largest value of gain, cross, beta, two notches of three, and corner.

    Cross-over at 0.6 of the bandwidth with the lead around it, notches on the resonances above it.
    """
    cross = 0.6 * limits.bandwidth
    found = [peak for peak in resonances(f, P) if peak > cross]
    found += [2.0 * (found[-1] if found else 2 * cross)] * (2 - len(found))
    gain = 1 / np.exp(np.interp(np.log(cross), np.log(f), np.log(np.abs(P))))
    corner = min(10 * limits.bandwidth, 0.2 / dt)
    rows = [_around(gain, "gain"), _around(cross, "cross"), _around(12.0, "beta")]
    for peak in found:
        rows += [_around(peak, "frequency", HIGHEST / dt), (LEAST_DEPTH, 0.2, 0.98), (0.05, 0.5, 1.5)]
    return np.log([*rows, _around(corner, "corner", HIGHEST / dt)])


def _around(value: float, name: str, most: float = np.inf) -> tuple[float, float, float]:
    low, high = BOUNDS[name]
    value = min(value, 0.8 * most)
    return low * value, value, min(high * value, most)


def _unfold(x: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Values within the box for the unbounded variables of the optimiser; 0 is the first value of each."""
    low, middle, high = box.T
    share = (middle - low) / (high - low)
    return np.exp(low + (high - low) / (1 + (1 - share) / share * np.exp(-4.0 * x)))


def _settings(x: np.ndarray, dt: float) -> SectionsSettings:
    """Settings of the filters for the values that the optimiser found."""
    gain, cross, beta, f_1, depth_1, p_1, f_2, depth_2, p_2, corner = (float(f"{v:.5g}") for v in x)
    k, alpha, tau_I, tau_D = _lead_lag(gain, cross, beta)
    lead_lag = {"kind": "lead_lag", "k": k, "alpha": alpha, "tau_I": tau_I, "beta": beta, "tau_D": tau_D}
    notches = [
        {"kind": "notch", "frequency": f_n, "zeta_z": float(f"{depth * p:.5g}"), "zeta_p": p}
        for f_n, depth, p in ((f_1, depth_1, p_1), (f_2, depth_2, p_2))
    ]
    return SectionsSettings.model_validate(
        {"sections": [lead_lag, *notches, {"kind": "low_pass", "frequency": corner}]}
    )


def _lead_lag(gain: float, cross: float, beta: float) -> tuple[float, float, float, float]:
    """k, alpha, tau_I and tau_D for a lead around `cross` Hz, where the gain is `gain` but for the lag."""
    lead = 1 / (2 * np.pi * cross)
    values = gain / LAG_RATIO / np.sqrt(beta), LAG_RATIO, LAG_BELOW * lead / LAG_RATIO, lead / np.sqrt(beta)
    return tuple(float(f"{v:.5g}") for v in values)  # type: ignore[return-value]


def _filters(x: np.ndarray, f: np.ndarray, dt: float) -> np.ndarray:
    """Response (n,) of the filters as they will be sampled, without building them: the bilinear transform of s."""
    gain, cross, beta, f_1, depth_1, p_1, f_2, depth_2, p_2, corner = x
    k, alpha, tau_I, tau_D = _lead_lag(gain, cross, beta)
    half = 1j * np.tan(np.pi * f * dt)
    s = half * 2 / dt
    K = k * (alpha * tau_I * s + 1) / (tau_I * s + 1) * (beta * tau_D * s + 1) / (tau_D * s + 1)
    for f_n, depth, p in ((f_1, depth_1, p_1), (f_2, depth_2, p_2)):
        q = half / np.tan(np.pi * f_n * dt)  # s / w_n, exact at w_n
        K = K * (q * q + 2 * depth * p * q + 1) / (q * q + 2 * p * q + 1)
    q = half / np.tan(np.pi * corner * dt)
    return np.asarray(K / (q * q + np.sqrt(2) * q + 1))


def _gain_margin(L: np.ndarray) -> float:
    """Gain margin in dB, from all points near the negative real axis above the cross-over.

    A resonance above the cross-over counts at any phase where its gain is within `AWAY` of 1: a resonance that is
    stable by its phase alone may be unstable on another machine.
    """
    above = np.flatnonzero(np.abs(L) > 1)
    gaps = np.flatnonzero(np.diff(above) > 1)
    rest = np.abs(L[(above[gaps[0]] if gaps.size else above[-1]) + 1 :])
    near = np.abs(np.angle(-L[-len(rest) :])) < NEAR
    margin = float(-20 * np.log10(np.max(rest[near]))) if near.any() else np.inf
    risen = rest > RISE * np.minimum.accumulate(rest)  # above the gain before it: a resonance, not noise
    peak = -20 * np.log10(np.max(rest[risen])) if risen.any() else np.inf
    return float(min(margin, AWAY[1] * peak / AWAY[0])) if peak < AWAY[0] else margin


def _missing(m: Margins, limits: Limits, slack: Slack | None = None) -> np.ndarray:
    """Violation of each limit in units of 5 dB, 20 degrees or a fifth of the bandwidth; 0 where it is met."""
    more = slack or Slack(0.0, 0.0, 0.0, 0.0)
    return np.maximum(
        [
            (limits.GM + more.GM - m.GM) / 5,
            (limits.PM + more.PM - m.PM) / 20,
            (m.M_S - limits.M_S + more.M_S) / 5,
            5 * np.log(limits.bandwidth * (1 + more.bandwidth) / m.bandwidth) if np.isfinite(m.bandwidth) else 0.0,
        ],
        0.0,
    )
