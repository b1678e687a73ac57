"""Figures and parts of chapter 11."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rtctl.design import mechanics
from rtctl.identify import luminance
from rtctl.reproduce import chapter11 as ch
from rtctl.reproduce import color11
from rtctl.reproduce import figures as fig
from rtctl.reproduce.rows import Part, Picture

STRIP, WAVE = 0.1e-3, 0.1  # m, thickness and wavelength of the strip in figure 11.4


def figure_11_2(short: bool) -> Picture:
    """Deviation of the capstan radius, and resulting position error."""
    one = ch.rippled(None, None, 0.0)
    figure, (above, below) = fig.panels(2, sharex=True, height=1.7)
    turns = 360 * one.x / ch.TURN
    fig.line(above, turns, 1e6 * np.gradient(_smooth(one.e), one.x) * ch.R_C, label="from the error, filtered")
    fig.line(below, turns, 1e6 * one.e, fig.RED)
    above.set(ylabel="R_c - mean [um]")
    below.set(ylabel="error [um]", xlabel="rotation of the capstan [deg]", xlim=(0, 1080))
    sentence = (
        "An oval capstan on the emulator: a radius that varies by 2 um gives an error of "
        f"{1e6 * 2 * ch.amplitude(one):.1f} um peak to peak."
    )
    return Picture("11.2", sentence, figure)


def figure_11_3(short: bool) -> Picture:
    """Reading error of an eccentric bearing over a turn."""
    theta = np.linspace(0, 2 * np.pi, 200)
    one = ch.rippled(0.0, None, None)
    figure, (axes,) = fig.panels(1)
    fig.line(axes, np.degrees(one.x / ch.R_C), -1e3 * (one.e - one.e.mean()) / ch.R_C, "#9ecbea", label="emulator")
    error = np.arctan(ch.ECCENTRICITY * np.cos(theta) / ch.R_G)
    at = one.x[np.argmax(_smooth(-one.e)[one.x < ch.TURN])] / ch.R_C  # start angle of the pass on the disc
    axes.plot(np.degrees(theta), 1e3 * np.interp(theta - at, theta, error, period=2 * np.pi), "--", color=fig.INK,
              linewidth=1.0, label="(11.5)")  # fmt: skip
    axes.set(xlabel="rotation [deg]", ylabel="reading error [mrad]", xlim=(0, 360))
    fig.legend(axes)
    sentence = (
        "Reading error of an encoder whose bearing is 5 um off the centre of its disc: "
        f"{1e3 * mechanics.disc_error(ch.ECCENTRICITY, ch.R_G):.2f} mrad, read by the emulator with its own "
        "counts."
    )
    return Picture("11.3", sentence, figure)


def figure_11_4(short: bool) -> Picture:
    """Position error by a wavy strip."""
    x = np.linspace(0, 0.2, 2001)
    slope = 2 * np.pi * STRIP / WAVE * np.cos(2 * np.pi * x / WAVE)
    e = np.concatenate(([0.0], np.cumsum(1 - np.hypot(1, slope))[:-1])) * (x[1] - x[0])
    figure, (above, below) = fig.panels(2, sharex=True, height=1.6)
    above.plot(1e3 * x, 1e3 * STRIP * np.sin(2 * np.pi * x / WAVE), color=fig.BLUE, linewidth=1.1)
    below.plot(1e3 * x, 1e6 * e, color=fig.RED, linewidth=1.1)
    above.set_ylabel("strip y [mm]")
    below.set(ylabel="error x - l [um]", xlabel="position [mm]")
    whole = -1e6 * mechanics.strip_error(STRIP, WAVE, 0.2)
    sentence = (
        f"Path along a strip with a wave of 0.1 mm over 100 mm, by (11.6): {whole:.1f} um over 200 mm, a small error "
        "for a wave of this size."
    )
    return Picture("11.4", sentence, figure)


def figure_11_5(short: bool) -> Picture:
    """Errors of capstan, bearing and coupling in worst and best phases."""
    figure, axes = fig.panels(1, 2)
    said = []
    cases = (("worst phases", (np.pi, np.pi, 0.0)), ("best phases", (np.pi, 0.0, 0.0)))
    for one, (words, phases) in zip(axes, cases, strict=True):
        run = ch.rippled(*phases)
        turns = 360 * run.x / ch.TURN
        fig.line(one, turns, 1e6 * (run.e - run.e.mean()), fig.RED)
        one.set(xlim=(0, 1080), ylim=(-8, 8), xlabel="rotation of the capstan [deg]")
        fig.title(one, words)
        said.append(1e6 * ch.amplitude(run))
    axes[0].set_ylabel("error [um]")
    sentence = (
        f"Capstan, bearing and coupling together on the emulator: {said[0]:.1f} um of amplitude where the errors "
        f"add, {said[1]:.1f} um where they cancel."
    )
    return Picture("11.5", sentence, figure)


def figure_11_6(short: bool) -> Picture:
    """Position error over 600 mm, with and without trend."""
    one, (found, _) = ch.printer(ch.SPEEDS[0]), ch.analysed(ch.SPEEDS[0])
    figure, (above, below) = fig.panels(2, sharex=True)
    fig.line(above, 1e3 * one.x, 1e3 * one.e)
    fig.line(below, 1e3 * found.x, 1e6 * found.e)
    above.set_ylabel("error [mm]")
    below.set(ylabel="without trend [um]", xlabel="position [mm]", xlim=(0, 600))
    value = ch.by_scale(short)
    sentence = (
        f"Position error of the emulated printer against its linear scale: {value['11.trend']:.2f} mm over 600 mm by a "
        f"capstan that is {value['11.radius']:.2f} um too large, chosen here from the 0.36 mm of the text."
    )
    return Picture("11.6", sentence, figure)


def two_scales(axes: Sequence[Any], wavelength: np.ndarray, size: np.ndarray, label: str) -> None:
    """Draw a spectrum, `size` (n,) over wavelengths (n,) in m, up to 600 mm and up to 40 mm in two axes."""
    for one, longest in zip(axes, (600, 40), strict=True):
        one.plot(1e3 * wavelength, size, ".-", color=fig.BLUE, linewidth=0.9, markersize=3)
        inside = wavelength <= 1e-3 * longest
        one.set(xlim=(0, longest), ylim=(0, 1.15 * float(size[inside].max())), ylabel=label)
    axes[-1].set_xlabel("wavelength [mm]")


def figure_11_7(short: bool) -> Picture:
    """Fourier transform of the error on two scales."""
    found, peaks = ch.analysed(ch.SPEEDS[0])
    figure, axes = fig.panels(2)
    two_scales(axes, found.wavelength, 1e6 * np.abs(found.E), "|E| [um]")
    size = {mm: 1e6 * float(np.abs(found.E[np.argmin(np.abs(found.wavelength - 1e-3 * mm))])) for mm in (150, 200, 300)}
    bins = ", ".join(f"{1e3 * peak.bin:.2f}" for peak in peaks)
    sentence = (
        f"Fourier transform (11.10) of the position error on two scales. The fitted waves have {bins} mm. The "
        "transform does not show 150 and 300 mm as two peaks, as the text says of its own figure: the window merges "
        f"both into one maximum, with {size[300]:.1f}, {size[200]:.1f} and {size[150]:.1f} um at 300, 200 and 150 mm."
    )
    return Picture("11.7", sentence, figure)


def figure_11_8(short: bool) -> Picture:
    """Luminance of a grey image, and its Fourier transform on two scales."""
    made, cross = ch.image()
    figure, axes = fig.panels(3, height=1.6)
    fig.line(axes[0], 1e3 * made.x, made.L, linewidth=0.8)
    axes[0].set(xlabel="position [mm]", ylabel="L*", xlim=(0, 600))
    two_scales(axes[1:], cross.wavelength, np.abs(cross.Gamma), "|Gamma| [L*]")
    sentence = (
        "Luminance of an emulated grey image and its Fourier transform: a peak at "
        f"{ch.by_luminance(short)['11.peak_luminance']:.2f} mm over the slow drift of ink and paper."
    )
    return Picture("11.8", sentence, figure)


def figure_11_9(short: bool) -> Picture:
    """Cross power spectrum on two scales."""
    _, cross = ch.image()
    figure, axes = fig.panels(2)
    two_scales(axes, cross.wavelength, 1e6 * np.abs(cross.S), "|S| [um L*]")
    share = [100 * float(np.abs(cross.S[np.argmin(np.abs(cross.wavelength - mm))]) / np.abs(cross.S).max())
             for mm in (0.15, 0.3)]  # fmt: skip
    sentence = (
        "Cross power spectrum of position error and emulated luminance on two scales: both have "
        f"{ch.by_luminance(short)['11.peak_cross']:.2f} mm, the turn of the capstan. The long waves of the guide are "
        f"weak, with {share[0]:.0f} % of this peak at 150 mm and {share[1]:.0f} % at 300 mm: the emulated luminance "
        "follows the slope of the error."
    )
    return Picture("11.9", sentence, figure)


def figure_11_10(short: bool) -> Picture:
    """Luminance through the band around a turn."""
    band = luminance.band_pass(ch.image()[0])
    figure, (axes,) = fig.panels(1)
    fig.line(axes, 1e3 * band.x, band.L)
    axes.set(xlim=(0, 600), xlabel="position [mm]", ylabel="L* in the band")
    sentence = (
        f"Luminance between 17 and 20 mm: a wave of {1e3 * band.wavelength:.2f} mm whose amplitude changes by "
        f"{100 * band.ripple:.0f} %."
    )
    return Picture("11.10", sentence, figure)


def _smooth(e: np.ndarray) -> np.ndarray:
    """Error (n,) without quantisation steps: the first three harmonics of a turn."""
    line = np.linspace(e[0], e[-1], len(e))
    spectrum_of = np.fft.rfft(e - line)
    spectrum_of[19:] = 0.0  # the pass has six turns
    return np.asarray(np.fft.irfft(spectrum_of, len(e)) + line)


PARTS = (
    Part("where errors come from", ch.ORIGINS, ch.origins,
         {"11.2": figure_11_2, "11.3": figure_11_3, "11.4": figure_11_4, "11.5": figure_11_5}),
    Part("error against the scale", ch.SCALE, ch.by_scale, {"11.6": figure_11_6, "11.7": figure_11_7}),
    Part("luminance of a grey image", ch.LUMINANCE, ch.by_luminance,
         {"11.8": figure_11_8, "11.9": figure_11_9, "11.10": figure_11_10}),
    Part("error tables", ch.TABLE, ch.tables),
    color11.PART,
)  # fmt: skip
