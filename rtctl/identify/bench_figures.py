"""Figures of the bench experiments: 8.4, 8.6, 11.6 to 11.10 and 12.3 of the thesis, from rtctl records."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rtctl.identify.driver_curve import DriverCurve
from rtctl.identify.friction import Friction
from rtctl.identify.luminance import Band, Cross, Image
from rtctl.identify.records import Record
from rtctl.identify.reel_radius import RUN_IN, accuracy
from rtctl.identify.scale_error import Pass, ScaleError
from rtctl.identify.stribeck import Stribeck
from rtctl.identify.wavelength import Peak, Spectrum
from rtctl.trace.plot import BLUE, GREEN, GREY, INK, ORANGE, RED, envelope


def friction(result: Friction) -> Figure:
    """Figure 8.4: friction over the capstan's speed, both directions, with the fit of (8.3)."""
    figure, (axes,) = _panels("Friction", 1)
    scale, unit = (1e3, "mNm") if result.unit == "Nm" else (1.0, result.unit)
    for points, words, marker in (
        ([p for p in result.points if p.v == 0.0], "break-away", "s"),
        ([p for p in result.points if p.v != 0.0], "constant speed", "o"),
    ):
        axes.plot([p.v for p in points], [scale * p.force for p in points], marker, color=BLUE, label=words)
    top = max((abs(p.v) for p in result.points), default=1.0)
    v = np.linspace(0.0, top, 400)
    for fit, sign in ((result.forward, 1.0), (result.backward, -1.0)):
        if fit is not None:
            axes.plot(
                sign * v, sign * scale * curve(fit, v), color=ORANGE, linewidth=1.2, label=None if sign < 0 else "(8.3)"
            )
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    _words(axes, "speed of the capstan [rad/s]", f"friction [{unit}]")
    return figure


def curve(fit: Stribeck, v: np.ndarray) -> np.ndarray:
    """Friction (n,) by (8.3) at speeds `v` (n,) in rad/s; without Stribeck term where the fit has none."""
    F = fit.F_C + fit.F_v * v
    return F if fit.F_S is None or fit.v_s is None else F + (fit.F_S - fit.F_C) * np.exp(-((v / fit.v_s) ** 2))


def radius(record: Record) -> Figure:
    """Figure of both radii by (5.2) over the capstan angle, with the accuracy (5.3) as a band."""
    figure, (axes,) = _panels("Reel radii by (5.2)", 1)
    phi, config = record["capstan"], record.config
    way = np.abs(phi - phi[0])
    rows = slice(0, int(np.argmax(way)) + 1)
    for name, color, sensor in (("reel1", BLUE, config.sensors.reel1), ("reel2", ORANGE, config.sensors.reel2)):
        n = record[f"{name}_counts"]
        angle = (n[rows] - n[0]) * 2.0 * np.pi / sensor.pulses
        with np.errstate(divide="ignore", invalid="ignore"):
            R = np.where(angle > 0, 1e3 * config.R_c * way[rows] / angle, np.nan)
            band = accuracy(sensor.pulses, 1.0) / angle
        x, y = way[rows], R
        axes.plot(x, y, color=color, linewidth=1.0, label=f"{name}, ratio so far")
        last = float(R[-1])
        axes.fill_between(x, last * (1 - band), last * (1 + band), color=color, alpha=0.15, linewidth=0)
    axes.axvline(1.9, color=GREY, linestyle=":", linewidth=1.0)
    axes.set_ylim(0, 1e3 * 1.6 * config.radius.measure.R_max)
    axes.set_xlim(RUN_IN / 4, None)
    _words(axes, "capstan [rad]; at 1.9 the largest reel is known to 5 %", "radius [mm]")
    return figure


def driver(result: DriverCurve) -> Figure:
    """Figure 12.3: mean current over the voltage, with the fit."""
    figure, (axes,) = _panels("Motor driver, motor held fast", 1)
    V = np.array([level.volts for level in result.levels])
    axes.plot(V, [level.ampere for level in result.levels], "o", color=BLUE, label="mean of 7500 samples")
    v = np.linspace(0.0, max(float(np.abs(V).max()), 0.1), 400)
    line = result.I_0 + result.gain * np.maximum(v - result.V_k, 0.0)
    axes.plot(v, line, color=ORANGE, linewidth=1.2, label="fit")
    _words(axes, "input [V]", "current [A]")
    return figure


def scale(one: Pass, trend: ScaleError, spectrum: Spectrum, peaks: Sequence[Peak]) -> Figure:
    """Figures 11.6 and 11.7: position error with and without trend, and its Fourier transform on two scales."""
    figure, axes = _panels("Position error, scale less encoder", 4)
    x, e = envelope(one.x, one.e)
    axes[0].plot(1e3 * x, 1e3 * e, color=BLUE, linewidth=1.1, label="error")
    line = trend.slope * one.x
    axes[0].plot(1e3 * one.x, 1e3 * (line + np.mean(one.e - line)), "--", color=INK, linewidth=1.0, label="trend")
    _words(axes[0], "position [mm]", "e [mm]")
    axes[1].plot(1e3 * spectrum.x, 1e6 * spectrum.e, color=BLUE, linewidth=1.1)
    _words(axes[1], "position [mm]", "without trend [um]")
    for one_axes, longest in ((axes[2], None), (axes[3], 25.0)):
        one_axes.plot(
            1e3 * spectrum.wavelength, 1e6 * spectrum.amplitude, ".-", color=BLUE, linewidth=1.0, markersize=4
        )
        one_axes.plot(1e3 * spectrum.wavelength, 1e6 * spectrum.noise, color=GREY, linewidth=1.0, label="noise around")
        for peak in peaks:
            if longest is None or 1e3 * peak.wavelength < longest:
                one_axes.axvline(1e3 * peak.wavelength, color=RED, linewidth=0.8, linestyle=":")
                one_axes.annotate(
                    f" {1e3 * peak.wavelength:.4g} mm",
                    (1e3 * peak.wavelength, 1e6 * peak.amplitude),
                    color=RED,
                    fontsize=9,
                )
        one_axes.set_xlim(0, longest or 1e3 * spectrum.wavelength[0] / 1.5)
        _words(one_axes, "wavelength [mm]", "amplitude [um]")
    return figure


def luminance(image: Image, cross: Cross, band: Band) -> Figure:
    """Figures 11.8 to 11.10: luminance, its Fourier transform, the cross spectrum, and the band around 18.75 mm."""
    figure, axes = _panels("Luminance of a printed grey image", 4)
    axes[0].plot(1e3 * image.x, image.L, color=BLUE, linewidth=1.0)
    _words(axes[0], "position [mm]", "L*")
    axes[1].semilogx(1e3 * cross.wavelength, cross.amplitude, color=BLUE, linewidth=1.0)
    _words(axes[1], "wavelength [mm]", "amplitude [L*]")
    axes[2].loglog(1e3 * cross.wavelength, 1e6 * np.abs(cross.S), color=GREEN, linewidth=1.0)
    _words(axes[2], "wavelength [mm]", "|S| [um L*]")
    axes[3].plot(1e3 * band.x, band.L, color=BLUE, linewidth=1.0)
    _words(axes[3], "position [mm]", f"L*, {1e3 * band.wavelength:.2f} mm")
    return figure


def steps(records: Sequence[Record], columns: Sequence[str], labels: Sequence[str]) -> Figure:
    """Figure 8.6 and the printing steps: position and reference, one panel for each record."""
    figure, axes = _panels("Step responses", len(records))
    for one, record, column, label in zip(axes, records, columns, labels, strict=True):
        t = record.t - record.t[0]
        unit, factor = ("rad", 1.0) if record.profile.unit == "rad" else ("mm", 1e3)
        one.plot(*envelope(t, factor * record["target"]), "--", color=INK, linewidth=1.0, label="reference")
        one.plot(*envelope(t, factor * record[column]), color=BLUE, linewidth=1.1, label=f"{column} {label}".strip())
        _words(one, "time [s]", f"[{unit}]")
    return figure


def _panels(title: str, count: int) -> tuple[Figure, Any]:
    figure = Figure(figsize=(9, 1.0 + (4.0 if count == 1 else 2.2 * count)), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(count, 1, squeeze=False)[:, 0]
    for one in axes:
        one.grid(True, color="#e3e5e8", linewidth=0.6)
        one.set_axisbelow(True)
        one.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title, x=0.01, ha="left", fontsize=12, fontweight="bold")
    return figure, axes


def _words(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(frameon=False, fontsize=9)
