"""`rtctl identify friction | radius | driver | scale | steps`: the experiments of the bench."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli import identify_source as sources
from rtctl.cli.common import JsonOption, SetOption
from rtctl.cli.identify_source import OutOption, PlotOption, SourceArgument, positive_si

if TYPE_CHECKING:
    from rtctl.identify.stribeck import Stribeck

app = typer.Typer(add_completion=False)
MARGIN = 6e-3  # m, length of a printed image beyond the analysed length


@app.command()
def friction(
    source: SourceArgument,
    set_: SetOption = None,
    turns: Annotated[float, typer.Option(metavar="N", min=1, help="Turns of the capstan to average over.")] = 12,
    speeds: Annotated[
        str | None,
        typer.Option(
            "--speeds", metavar="LIST", help="Capstan speeds in rad/s, e.g. 0.2,1,4; the usual ones if absent."
        ),
    ] = None,
    out: OutOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
) -> None:
    """Friction by break-away and at constant speeds, both ways, with the Stribeck curve (8.3) through both.

    Examples:

      rtctl identify friction ivu --plot friction.png

      rtctl identify friction ldu_printer --turns 4 --speeds 2,5,10
    """
    from rtctl.identify import friction as experiment

    def plan(config: Any) -> list[Any]:
        return [
            experiment.break_away_config(config),
            experiment.velocity_config(config, _list(speeds, "--speeds"), turns),
        ]

    records = _records(source, set_, out, json, plan)
    points, refused = experiment.points_of(records, turns)
    result = experiment.friction(points, refused, records[0].kind)
    split = None
    if records[0].profile.pairs and len(records) > 2:
        from rtctl.config.errors import NoAnswer

        try:
            split = experiment.split(records, turns)
        except NoAnswer as error:
            refused.append(str(error))
    if plot is not None:
        from rtctl.identify import bench_figures

        _save(bench_figures.friction(result), plot)
    if json:
        common.print_json({**_plain(result), "split": _plain(split) if split else None})
        return
    scale, unit = (1e3, "mNm") if result.unit == "Nm" else (1.0, result.unit)
    typer.echo(f"{'rad/s':>8}{unit:>10}{'+-':>9}{'N':>9}")
    for p in sorted(result.points, key=lambda p: (p.force < 0, abs(p.v))):
        words = "  break-away" if p.v == 0.0 else ""
        typer.echo(f"{p.v:8.3g}{scale * p.force:10.4f}{2 * scale * p.error:9.4f}{p.newtons:9.3f}{words}")
    for name, fit in (("both", result.both), ("forward", result.forward), ("backward", result.backward)):
        typer.echo(f"{name:9}{_stribeck(fit, scale, unit)}")
    if split:
        typer.echo("  ".join(f"{n} {1e3 * getattr(split, n):.3f} mNm" for n in ("tau_1", "tau_2", "tau_c")))
    for why in refused:
        typer.echo(f"left out  {why}")


@app.command()
def radius(
    source: SourceArgument,
    set_: SetOption = None,
    travel: Annotated[
        float, typer.Option(metavar="RAD", min=0.2, help="Least travel of one pass, in rad of the capstan.")
    ] = 1.9,
    out: OutOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
) -> None:
    """Reel radii from the pulses of the reels against the angle of the capstan (5.2).

    Examples:

      rtctl identify radius ivu --set plant.parameters.R1=30mm --set radius.R1=30mm
    """
    from rtctl.identify import reel_radius

    records = _records(source, set_, out, json, lambda config: [reel_radius.radius_config(config, 2 * travel)])
    found = [one for record in records for one in reel_radius.reel_radii(record, travel)]
    if plot is not None:
        from rtctl.identify import bench_figures

        _save(bench_figures.radius(records[0]), plot)
    if json:
        common.print_json({"ways": [_plain(one) for one in found]})
        return
    typer.echo(f"{'':6}{'R mm':>9}{'+-':>8}{'(5.2) mm':>10}{'(5.3) %':>9}{'pulses':>8}")
    for one in found:
        typer.echo(f"{one.travel:+.2f} rad of the capstan from {one.begin:.2f} s")
        for name, r in (("reel 1", one.R1), ("reel 2", one.R2)):
            typer.echo(
                f"{name}{1e3 * r.R:9.3f}{1e3 * r.half:8.3f}{1e3 * r.plain:10.2f}{100 * r.accuracy:9.1f}{r.pulses:8}"
            )


@app.command()
def driver(
    source: SourceArgument,
    set_: SetOption = None,
    out: OutOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
) -> None:
    """Curve of the linear drive's amplifier, 0 to 3 V in steps of 0.1 V, with the motor held fast (12.3).

    On a bench, clamp the carriage first: only the clamp holds it.

    Examples:

      rtctl identify driver ldu_printer --plot driver.png
    """
    from rtctl.identify import driver_curve

    records = _records(source, set_, out, json, lambda config: [driver_curve.driver_config(config)])
    result = driver_curve.driver_curve(records[0])
    if plot is not None:
        from rtctl.identify import bench_figures

        _save(bench_figures.driver(result), plot)
    if json:
        common.print_json(_plain(result))
        return
    typer.echo(f"{'V':>7}{'A':>9}{'sd':>9}")
    for level in result.levels:
        typer.echo(f"{level.volts:7.3f}{level.ampere:9.4f}{level.deviation:9.1e}")
    if result.I_0:
        torque = "" if result.torque is None else f" ({1e3 * result.torque:.2f} mNm)"
        typer.echo(f"{result.I_0:.4f} A{torque} below {result.V_k:.2f} V")
    typer.echo(f"{result.gain:.4f} +- {result.gain_half:.1e} A/V, {result.at_3:.3f} A at 3 V")


@app.command()
def scale(
    source: SourceArgument,
    set_: SetOption = None,
    travel: Annotated[str, typer.Option("--travel", metavar="X", help="Length that is analysed.")] = "600mm",
    speed: Annotated[
        list[str] | None,
        typer.Option(
            "--speed", metavar="V", help="With a CONFIG; two speeds separate errors of position from errors of time."
        ),
    ] = None,
    luminance: Annotated[bool, typer.Option("--luminance", help="Emulate a grey print with this error, too.")] = False,
    out: OutOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
) -> None:
    """Position error of the encoder against the linear scale: trend, radius of the capstan, wavelengths (11.2).

    Examples:

      rtctl identify scale ldu_printer --plot error.png

      rtctl identify scale runs/slow runs/fast --travel 300mm --json
    """
    from rtctl.identify import scale_error, wavelength
    from rtctl.machines.profile import SCALE

    length = positive_si(travel, "--travel", "m", "600mm")
    speeds = [positive_si(text, "--speed", "m/s", "20mm/s") for text in speed or ("20mm/s", "50mm/s")]
    records = _records(
        source, set_, out, json, lambda config: [scale_error.scale_config(config, length + MARGIN, v) for v in speeds]
    )
    R_c = records[0].config.sensors.R_c if records[0].profile.has(SCALE) else 0.0
    every = [one for record in records for one in scale_error.passes(record, length)]
    trends = [scale_error.scale_error(one.x, one.e, R_c) for one in every]
    spectra = [wavelength.spectrum(one.x, one.e, x_e=min(length, float(one.x[-1]))) for one in every]
    peaks = [wavelength.peaks(spectrum, R_c) for spectrum in spectra]
    other = next((i for i, one in enumerate(every) if abs(one.speed / every[0].speed - 1) > 0.2), None)
    origins = None
    if other is not None:
        origins = wavelength.origin(peaks[0], every[0].speed, peaks[other], every[other].speed)
    image = _image(scale_error.passes(records[0])[0], length) if luminance else None
    if plot is not None:
        from rtctl.identify import bench_figures

        _save(bench_figures.scale(every[0], trends[0], spectra[0], peaks[0]), plot)
        if image:
            _save(bench_figures.luminance(*image), plot.with_stem(plot.stem + "-luminance"))
    if json:
        common.print_json(_scale_json(every, trends, peaks, origins, image))
        return
    for one, trend in zip(every, trends, strict=True):
        typer.echo(
            f"{1e3 * one.speed:.3g} mm/s: {1e3 * trend.rise:+.3f} mm over {1e3 * trend.travel:.0f} mm, radius "
            f"{1e6 * trend.radius_error:+.2f} +- {1e6 * trend.radius_half:.2f} um, rest {1e6 * trend.periodic:.1f} um"
        )
    typer.echo(f"{'bin mm':>8}{'mm':>9}{'+-':>8}{'um':>8}{'+-':>7}{'order':>8}{'sure %':>9}  goes with")
    for i, p in enumerate(peaks[0]):
        words = origins[i].kind if origins else ""
        typer.echo(
            f"{1e3 * p.bin:8.2f}{1e3 * p.wavelength:9.3f}{1e3 * p.half:8.3f}{1e6 * p.amplitude:8.2f}"
            f"{1e6 * p.amplitude_half:7.2f}{p.order or 0:8.3f}{100 * p.confidence:9.3f}  {words}"
        )
    if image:
        from rtctl.identify import luminance as printing

        _, cross, band = image
        found = ", ".join(f"{1e3 * line:.2f} mm" for line, _, _ in printing.shared(cross))
        typer.echo(f"luminance shares {found}; band {1e3 * band.wavelength:.2f} mm, {band.amplitude:.2f} L*")


@app.command()
def steps(
    source: SourceArgument,
    set_: SetOption = None,
    by: Annotated[str | None, typer.Option("--by", metavar="COLUMN", help="Sensor that judges, e.g. scale.")] = None,
    out: OutOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
) -> None:
    """Step responses: 1/12 and 1/24 mm on a linear drive, a radian on a reel unit (8.3).

    Examples:

      rtctl identify steps ldu --by scale

      rtctl identify steps runs/steps --json
    """
    from rtctl.identify import steps as experiment
    from rtctl.machines.profile import SCALE

    records = _records(source, set_, out, json, experiment.usual_configs)
    found = [experiment.steps(record, by) for record in records]
    labels = [f"{1e3 * experiment.size_mm(one):.1f} um" if records[0].profile.has(SCALE) else "" for one in found]
    if plot is not None:
        from rtctl.identify import bench_figures

        _save(bench_figures.steps(records, [one.by for one in found], labels), plot)
    if json:
        common.print_json({"records": [_plain(one) for one in found]})
        return
    typer.echo(
        f"{'size mm':>9}{'steps':>7}{'mean um':>9}{'worst um':>10}{'spread um':>11}{'over %':>8}{'settle s':>10}"
    )
    for one in found:
        settling = "never" if one.settling_s is None else f"{one.settling_s:.3f}"
        typer.echo(
            f"{experiment.size_mm(one):9.4f}{len(one.each):11}{1e3 * one.mean_mm:11.2f}{1e3 * one.worst_mm:11.2f}"
            f"{1e3 * one.spread_mm:11.2f}{one.overshoot_pct:11.2f}{settling:>11}"
        )


def _records(source: list[str], set_: list[str] | None, out: Path | None, json: bool, plan: Any) -> list[Any]:
    """Records of bundles, or of runs of the configs that `plan` makes. Raises NoAnswer where a run tripped."""
    from rtctl.identify.bench import seconds, whole

    found = sources.records(source, set_, out, json, lambda config: [(one, seconds(one)) for one in plan(config)])
    return [whole(record) for record in found]


def _image(one: Any, length: float) -> tuple[Any, Any, Any]:
    from rtctl.identify import luminance

    image = luminance.printed(one.x, one.e)
    length = min(length, float(image.x[-1] - image.x[0]))
    return image, luminance.cross_spectrum(one.x, one.e, image, 1200, length), luminance.band_pass(image)


def _scale_json(every: Any, trends: Any, peaks: Any, origins: Any, image: Any) -> dict[str, Any]:
    result: dict[str, Any] = {
        "passes": [
            {"speed": one.speed, "trend": _plain(trend), "peaks": [_plain(p) for p in found]}
            for one, trend, found in zip(every, trends, peaks, strict=True)
        ],
        "origins": None if origins is None else [_plain(o) for o in origins],
    }
    if image:
        from rtctl.identify import luminance

        _, cross, band = image
        result["luminance"] = {
            "shared": [{"wavelength": w, "S": s, "confidence": c} for w, s, c in luminance.shared(cross)],
            "band": {k: getattr(band, k) for k in ("wavelength", "half", "amplitude", "ripple")},
        }
    return result


def _stribeck(fit: "Stribeck | None", scale: float, unit: str) -> str:
    if fit is None:
        return "too few speeds for a curve"
    words = [f"F_C {scale * fit.F_C:.4f} +- {scale * fit.F_C_half:.4f} {unit}"]
    words.append("no more at standstill" if fit.F_S is None else f"F_S {scale * fit.F_S:.4f} {unit}")
    if fit.v_s is not None:
        words.append(f"v_s {fit.v_s:.3g} +- {fit.v_s_half or 0:.2g} rad/s")
    words.append(f"F_v {scale * fit.F_v:.2g} +- {scale * fit.F_v_half:.1g} {unit} s/rad")
    return ", ".join(words)


def _plain(value: Any) -> Any:
    """Value for JSON: named tuples become dicts, recursively."""
    if hasattr(value, "_asdict"):
        return {key: _plain(item) for key, item in value._asdict().items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return {key: _plain(item) for key, item in value.items()} if isinstance(value, dict) else value


def _list(text: str | None, option: str) -> list[float] | None:
    from rtctl.config.errors import UserError

    if text is None:
        return None
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        raise UserError(f"{option} {text}: write numbers with commas, e.g. 0.2,1,4") from None
    if min(values) <= 0:
        raise UserError(f"{option} {text}: every speed must be above 0")
    return values


def _save(figure: Any, path: Path) -> None:
    from rtctl.trace.plot import save

    save(figure, path)
