"""Chapter 11, measurement error: origins, wavelengths and correction of the position error of the linear drive."""

from functools import cache
from typing import Any

import numpy as np

from rtctl.config.load import set_path
from rtctl.design import error_table, mechanics
from rtctl.identify import bench, luminance, scale_error, wavelength
from rtctl.identify.luminance import Cross, Image
from rtctl.identify.scale_error import Pass
from rtctl.identify.wavelength import Peak, Spectrum
from rtctl.reproduce.chapter10 import PRESENT_LAW
from rtctl.reproduce.played import config
from rtctl.reproduce.rows import NONE, Row, under

R_C = 3e-3  # m, nominal
TURN = 2 * np.pi * R_C  # m
LENGTH, N = 0.6, 1200  # m and steps of the analysis (11.2)
TRAVEL = 0.612  # m; the luminance image is slightly shorter
SPEEDS = (0.05, 0.03)  # m/s, speeds of two passes that separate position from time
OVAL, ECCENTRICITY, R_G, COUPLING = 2e-6, 5e-6, 19e-3, 1e-3  # m, m, m, rad (11.1)

VELOCITY = "velocity 200 Hz"
PRINTER = "figure_12_2, the error chain of ldu_printer"
THREE = "We see three high peaks in the amplitude"
OTHERS = r"The second and the third peaks, at  $\lambda_k = 150$  [mm] and  $\lambda_k = 300$  [mm]"
GUIDE = "guide terms of 8 um at 300 mm and 6 um at 150 mm in the emulator"

ORIGINS = under(
    Row("11.wavelength", "turn of the capstan", "11.1, (11.4)", 18.85, "mm", 0.002,
        quote=r"we get  $\lambda_c = 18.85$  [mm]", set="figure_12_2"),
    Row("11.capstan", "largest error of a capstan that is oval by 2 um", "11.1, (11.3), figure 11.2", 4.0, "um", 0.05,
        quote=r"Here it is  $e_c = 4 \cdot 10^{-3}$  [mm]", set="figure_12_2, ripple.capstan"),
    Row("11.bearing", "reading error of an encoder bearing 5 um off centre", "11.1, (11.5)", 3e-4, "rad", 0.5e-4,
        relative=False, quote=r"at the size of  $\Delta\theta_b = 3 \cdot 10^{-4}$  [rad]", law=NONE, set=NONE,
        filter=NONE, remark="one digit in the text; 2.6e-4 rad by the equation"),
    Row("11.coupling", "error by a stator coupling that turns by 1 mrad", "11.1", 3.0, "um", 0.05,
        quote=r"causes a significant error in the position measurement of 3 [ $\mu\text{m}$ ]",
        set="figure_12_2, ripple.encoder"),
    Row("11.worst_case", "amplitude of all three errors in the worst phases", "11.1, (11.8), figure 11.5(a)", 6.0, "um",
        0.5,
        relative=False, quote=r"The error  $e$  has now a maximum of  $6 \text{ } [\mu\text{m}]$",
        set="figure_12_2, all three", remark="one digit in the text; 2 + 0.8 + 3 um"),
    Row("11.best_case", "amplitude of all three errors in the best phases", "11.1, (11.8), figure 11.5(b)", 0.0, "um",
        0.5, relative=False,
        quote="the resulting error  $e$  is nihil", set="figure_12_2, all three",
        remark="nihil in the text; 2 + 0.8 - 3 um give 0.2 um"),
    law=PRESENT_LAW, filter=VELOCITY,
)  # fmt: skip
SCALE = under(
    Row("11.trend", "rise of the error by its trend over 600 mm", "11.2, figure 11.6(a)", 0.36, "mm", 0.03,
        quote="Over 600 [mm], the error increased 0.36 [mm]",
        chosen="R_c = 3.0018 mm in the emulator, from this number"),
    Row("11.radius", "deviation of the capstan's mean radius", "11.2", 1.8, "um", 0.03,
        quote=r"$\bar{R}_c - \hat{R}_c = 1.8$  [ $\mu\text{m}$ ]", chosen="R_c = 3.0018 mm in the emulator"),
    Row("11.peak_capstan", "peak of the error's spectrum at the turn of the capstan", "11.2, figure 11.7", 18.75, "mm",
        0.001, quote=r"The first one, at  $\lambda_k = 18.75$  [mm]"),
    Row("11.peak_150", "bin of the second wave that is fitted", "11.2, figure 11.7", 150.0, "mm", 0.001,
        quote=OTHERS, chosen=GUIDE, remark="|E| has no maximum at 150 mm: it is higher at 200 mm, between both"),
    Row("11.peak_300", "bin of the third wave that is fitted", "11.2, figure 11.7", 300.0, "mm", 0.001,
        quote=OTHERS, chosen=GUIDE),
    Row("11.line_capstan", "wavelength of the first peak, fitted between the bins", "11.1, (11.4)", 18.85, "mm", 0.003,
        quote=r"we get  $\lambda_c = 18.85$  [mm]"),
    Row("11.of_position", "waves that stay at their position when the speed changes", "11.2", None, "", expected=3.0,
        quote=THREE,
        remark="the text has one speed; the second speed is chosen here as a check"),
    law=PRESENT_LAW, set=PRINTER, filter=VELOCITY,
)  # fmt: skip
LUMINANCE = under(
    Row("11.peak_luminance", "peak of the luminance of a grey image below 100 mm", "11.2, figure 11.8", 18.75, "mm",
        0.001, quote=r"amplitudes at long wavelengths and a peak at  $\lambda_k = 18.75$  [mm]"),
    Row("11.peak_cross", "peak of the cross spectrum", "11.2, figure 11.9", 18.75, "mm", 0.001,
        quote="This figure clearly shows the effect of the mechanical errors",
        remark="both spectra have 18.75 mm; the text gives no wavelength for this figure"),
    Row("11.band", "wavelength of the luminance between 17 and 20 mm", "11.3, figure 11.10", 18.75, "mm", 0.01,
        quote=r"The result is a relative constant amplitude wave with  $\lambda \approx 18.75$  [mm]"),
    law=PRESENT_LAW, set=PRINTER + ", luminance chosen here", filter=VELOCITY,
)  # fmt: skip
TABLE = under(
    *(
        Row(f"11.table_{name}", f"share of the capstan's error that a table from {words} removes",
            f"11.3, {equation}", None, "%", bound="at least", expected=90.0,
            quote="these errors could be reduced", remark="no number in the text; 90 % is chosen here")
        for name, words, equation in (
            ("scale", "the linear scale", "(11.12)"), ("luminance", "the luminance", "(11.11), (11.12)"))
    ),
    law=PRESENT_LAW, set=PRINTER, filter=VELOCITY,
)  # fmt: skip


def terms(bearing: float | None = None, coupling: float | None = None, capstan: float | None = 0.0) -> list[Any]:
    """Plant terms for the errors of 11.1; each argument is a phase in rad, None without the error."""
    encoder = {"term": "ripple.encoder", "node": "encoder"}
    found: list[Any] = []
    if capstan is not None:
        found.append({"term": "ripple.capstan", "node": "capstan", "a": OVAL, "phi": capstan})
    if bearing is not None:
        found.append({**encoder, "A": mechanics.disc_error(ECCENTRICITY, R_G), "phi": bearing})
    if coupling is not None:
        found.append({**encoder, "A": COUPLING, "phi": coupling})
    return found


@cache
def rippled(bearing: float | None, coupling: float | None, capstan: float | None) -> Pass:
    """Pass of the linear drive with only these errors."""
    made = bench.changed(config("ldu"), {"plant.physics": terms(bearing, coupling, capstan)})
    (one,) = scale_error.passes(bench.play(scale_error.scale_config(made, 6 * TURN, SPEEDS[0])))
    return one


def amplitude(one: Pass) -> float:
    """Amplitude in m of the error with one period per turn."""
    return float(np.sqrt(2)) * error_table.periodic(one.x, one.e, TURN, harmonics=1)


def turn() -> float:
    """Travel in m of a capstan turn by the scale."""
    one = rippled(None, None, None)
    return TURN * (1 + float(np.polyfit(one.x, one.e, 1)[0]))


def origins(short: bool) -> dict[str, float]:
    """Rows of each error alone and of all errors together, on the emulator."""
    return {
        "11.wavelength": 1e3 * turn(),
        "11.capstan": 1e6 * 2 * amplitude(rippled(None, None, 0.0)),
        "11.bearing": mechanics.disc_error(ECCENTRICITY, R_G),
        "11.coupling": 1e6 * amplitude(rippled(None, 0.0, None)),
        "11.worst_case": 1e6 * amplitude(rippled(np.pi, np.pi, 0.0)),
        "11.best_case": 1e6 * amplitude(rippled(np.pi, 0.0, 0.0)),
    }


@cache
def printer(speed: float) -> Pass:
    """Pass of the printer of chapter 11 along its scale at `speed` in m/s."""
    (one,) = scale_error.passes(bench.play(scale_error.scale_config(config("ldu_printer"), TRAVEL, speed)))
    return one


@cache
def analysed(speed: float) -> tuple[Spectrum, tuple[Peak, ...]]:
    """Spectrum over 600 mm and its peaks, of a pass at `speed` in m/s."""
    one = printer(speed)
    found = wavelength.spectrum(one.x, one.e, N, LENGTH)
    return found, wavelength.peaks(found, R_C)


def by_scale(short: bool) -> dict[str, float]:
    """Rows of trend and peaks of the printer, and of the origin of the peaks."""
    one = printer(SPEEDS[0])
    inside = one.x <= LENGTH
    trend = scale_error.scale_error(one.x[inside], one.e[inside], R_C)
    _, found = analysed(SPEEDS[0])
    first, second, third = sorted(found, key=lambda peak: peak.wavelength)[:3]
    others = wavelength.origin(found, SPEEDS[0], analysed(SPEEDS[1])[1], SPEEDS[1])
    return {
        "11.trend": 1e3 * trend.rise,
        "11.radius": 1e6 * trend.radius_error,
        "11.peak_capstan": 1e3 * first.bin,
        "11.peak_150": 1e3 * second.bin,
        "11.peak_300": 1e3 * third.bin,
        "11.line_capstan": 1e3 * first.wavelength,
        "11.of_position": sum(one.kind == "position" for one in others),
    }


@cache
def image() -> tuple[Image, Cross]:
    """Grey image printed by a pass of the printer, and its cross spectrum with the error."""
    one = printer(SPEEDS[0])
    made = luminance.printed(one.x, one.e)
    return made, luminance.cross_spectrum(one.x, one.e, made, N, LENGTH)


def by_luminance(short: bool) -> dict[str, float]:
    """Rows of the peaks of luminance and cross spectrum, and of the band around a turn."""
    made, cross = image()
    near = np.where(cross.wavelength < 0.1, cross.amplitude, 0.0)  # ink and paper drift dominates longer wavelengths
    return {
        "11.peak_luminance": 1e3 * float(cross.wavelength[np.argmax(near)]),
        "11.peak_cross": 1e3 * luminance.shared(cross)[0][0],
        "11.band": 1e3 * luminance.band_pass(made).wavelength,
    }


@cache
def left(values: tuple[float, ...], speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Encoder position and error (both in m) of the printer with an error table, within the table's range."""
    made = set_path(config("ldu_printer"), "sensors.correction", {"period": TURN, "values": list(values)})
    record = bench.play(scale_error.scale_config(made, TRAVEL, speed))
    x = record["encoder_counts"] * (2 * np.pi / bench.counts_per_turn(record)) * R_C
    inside = (x > 0.02) & (x < LENGTH)
    return x[inside][::10], (record["scale"] - record["position"])[inside][::10]


def tables(short: bool) -> dict[str, float]:
    """Rows of error tables from scale and from image; the gain of the image comes from a separate pass."""
    none = (0.0, 0.0)
    (x, e), (x_2, e_2) = (left(none, speed) for speed in SPEEDS)
    by_image, known = (luminance.printed(*both, luminance.PrintSettings(seed=s)) for s, both in
                       ((1, (x, e)), (2, (x_2, e_2))))  # fmt: skip
    gain = error_table.luminance_gain(known.x, known.L, np.interp(known.x, x_2, e_2), TURN)
    made = {
        "scale": error_table.from_scale(x, e, TURN),
        "luminance": error_table.from_luminance(by_image.x, by_image.L, TURN, gain),
    }
    before = error_table.periodic(x, e, TURN)
    after = {n: error_table.periodic(*left(tuple(t.settings.values), SPEEDS[0]), TURN) for n, t in made.items()}
    return {f"11.table_{name}": 100 * (1 - value / before) for name, value in after.items()}
