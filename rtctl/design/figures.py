"""Pictures of designs: Bode, Nyquist and step response of a loop before and after, and maps over the reel radii."""

from typing import Any

import control
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from rtctl.design import margins, response, systems
from rtctl.design.margins import Margins
from rtctl.design.robustness import Map
from rtctl.trace.plot import BLUE, GREY, INK, ORANGE, RED

PALE, HALO = "#ffffff", [withStroke(linewidth=2, foreground=INK)]
DEEPEST = -80.0  # dB of the Bode plot
NYQUIST = 2.5  # half width of the Nyquist plot
SETTLED = 6.0  # periods of the slowest bandwidth that the step responses show


def loops(configs: dict[str, Any], motor: int = 1) -> Figure:
    """Bode plot, Nyquist plot, |S| and |T|, and step response of one loop or more; `configs` by their label."""
    figure = Figure(figsize=(11, 8.5), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplot_mosaic([["gain", "nyquist"], ["phase", "nyquist"], ["closed", "step"]])
    reached = {label: margins.of_config(config, motor) for label, config in configs.items()}
    seconds = SETTLED / min(m.bandwidth if np.isfinite(m.bandwidth) else m.f_PM for m in reached.values())
    for (label, config), color in zip(configs.items(), _colors(len(configs)), strict=True):
        _loop(grid, config, label, color, motor)
        if reached[label].stable:
            _step(grid["step"], config, label, color, motor, seconds)
    _finish_bode(grid["gain"], grid["phase"])
    _finish_nyquist(grid["nyquist"], list(reached.values())[-1])
    closed = grid["closed"]
    closed.axhline(-3, color=GREY, linewidth=0.8, linestyle=":")
    closed.set(ylabel="gain [dB]", xlabel="frequency [Hz]", ylim=(-40, 16))
    closed.legend(frameon=False, fontsize=8, loc="lower left", ncols=len(configs))
    grid["step"].set(xlabel="time [s]", ylabel="step response, model")
    if grid["step"].lines:
        grid["step"].legend(frameon=False, fontsize=8, loc="lower right")
    for axes in grid.values():
        axes.grid(True, color="#e3e5e8", linewidth=0.7)
        axes.set_axisbelow(True)
    words = [f"{label}: {_words(m)}" for label, m in reached.items()]
    figure.suptitle("\n".join(words), fontsize=10, x=0.01, ha="left")
    return figure


def radii(maps: dict[str, Map]) -> Figure:
    """Gain margin over both reel radii, one panel a map; `maps` by their title."""
    figure = Figure(figsize=(5.2 * len(maps), 4.4), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (title, found) in zip(figure.subplots(1, len(maps), squeeze=False)[0], maps.items(), strict=True):
        drive, other = 1e3 * found.R_drive, 1e3 * found.R_other
        drawn = axes.contourf(other, drive, found.GM, levels=np.arange(0, 23, 2), cmap="viridis", extend="both")
        lines = axes.contour(other, drive, found.GM, levels=[3, 6], colors=["#ffffff"], linewidths=1.2)
        axes.clabel(lines, fmt="%g dB", fontsize=8)
        for i in range(0, len(drive), max(1, len(drive) // 4)):
            for j in range(0, len(other), max(1, len(other) // 4)):
                words = f"{found.GM[i, j]:.1f}"
                axes.annotate(
                    words, (other[j], drive[i]), fontsize=7, ha="center", va="center", color=PALE, path_effects=HALO
                )
        axes.set_xlim(other[0] - 1, other[-1] + 1)
        axes.set_ylim(drive[0] - 1, drive[-1] + 1)
        axes.set(xlabel="radius of the other reel [mm]", ylabel="radius of the reel that pulls [mm]")
        axes.set_title(f"{title}: at least {found.worst[0]:.1f} dB", fontsize=10)
        figure.colorbar(drawn, ax=axes, label="gain margin [dB]")
    return figure


def _loop(grid: dict[str, Axes], config: Any, label: str, color: str, motor: int) -> None:
    parts = response.take(config, motor)
    L_of, forward_of = margins.loops(parts)
    f = margins.refined(L_of, 0.1, margins.HIGH / parts.dt)
    L = L_of(f)
    S, T = 1 / (1 + L), forward_of(f) / (1 + L)
    grid["gain"].semilogx(f, _db(L), color=color, linewidth=1.2, label=label)
    phase = np.unwrap(np.angle(L))
    phase -= 2 * np.pi * np.round((phase[np.argmin(np.abs(np.log(np.abs(L))))] + 0.7 * np.pi) / (2 * np.pi))
    grid["phase"].semilogx(f, np.degrees(phase), color=color, linewidth=1.2)
    grid["nyquist"].plot(L.real, L.imag, color=color, linewidth=1.2, label=label)
    grid["closed"].semilogx(f, _db(T), color=color, linewidth=1.2, label=f"|T| {label}")
    grid["closed"].semilogx(f, _db(S), "--", color=color, linewidth=0.9, label=f"|S| {label}")


def _step(axes: Axes, config: Any, label: str, color: str, motor: int, seconds: float) -> None:
    system = systems.closed(config, motor)
    t = np.arange(max(int(seconds / system.dt), 50)) * system.dt
    axes.plot(*control.step_response(system, T=t), color=color, linewidth=1.2, label=label)


def _finish_bode(gain: Axes, phase: Axes) -> None:
    gain.axhline(0, color=INK, linewidth=0.8)
    gain.set(ylabel="|L| [dB]", ylim=(DEEPEST, 60))
    gain.legend(frameon=False, fontsize=8)
    phase.axhline(-180, color=INK, linewidth=0.8)
    phase.set(ylabel="phase of L [deg]", xlabel="frequency [Hz]", ylim=(-450, 0), yticks=np.arange(-450, 1, 90))


def _finish_nyquist(axes: Axes, found: Margins) -> None:
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, 200))
    axes.plot(turn.real, turn.imag, ":", color=GREY, linewidth=0.9)
    near = -1 + turn * 10 ** (-found.M_S / 20)
    axes.plot(near.real, near.imag, "--", color=RED, linewidth=0.9, label=f"|S| = {found.M_S:.1f} dB")
    axes.plot(-1, 0, "+", color=RED, markersize=9)
    axes.set(xlim=(-NYQUIST, NYQUIST), ylim=(-NYQUIST, NYQUIST), xlabel="Re L", ylabel="Im L", aspect="equal")
    axes.legend(frameon=False, fontsize=8, loc="upper right")


def _words(m: Margins) -> str:
    return (
        f"bandwidth {m.bandwidth:.3g} Hz, GM {m.GM:.1f} dB at {m.f_GM:.3g} Hz, PM {m.PM:.0f} deg at {m.f_PM:.3g} Hz, "
        f"|S| up to {m.M_S:.1f} dB"
    )


def _db(x: np.ndarray) -> np.ndarray:
    return 20 * np.log10(np.abs(x))


def _colors(n: int) -> list[str]:
    return [GREY, BLUE, ORANGE, RED][-n:] if n == 1 else [GREY, BLUE, ORANGE, RED][:n]
