"""`rtctl identify frf | multisine | fit`: frequency responses in closed loop, and the model that fits them."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli import identify_source as sources
from rtctl.cli.common import JsonOption, SetOption
from rtctl.cli.identify_source import OutOption, PlotOption, SourceArgument, positive_si

if TYPE_CHECKING:
    from rtctl.identify.best_linear import BestLinear
    from rtctl.identify.frf import Frf
    from rtctl.identify.model_fit import Fit
    from rtctl.identify.sensitivity import Sensitivity

app = typer.Typer(add_completion=False)
ROWS = 12  # lines of a response in a table

MotorOption = Annotated[
    int, typer.Option("--motor", metavar="N", min=1, max=2, help="Reel unit: the motor that is excited.")
]
RmsOption = Annotated[str | None, typer.Option("--rms", metavar="V", help="Size of the excitation, e.g. 0.5V.")]
SpeedOption = Annotated[str | None, typer.Option("--speed", metavar="V", help="Constant speed, e.g. 2rad/s or 5mm/s.")]
BandOption = Annotated[
    str | None,
    typer.Option("--band", metavar="LOW:HIGH", help="Band in Hz; exit code 3 where the data do not support all of it."),
]
AmpereOption = Annotated[bool, typer.Option("--per-ampere", help="Divide by the known drive.")]
KeepOption = Annotated[bool, typer.Option("--keep-law", help="Run with the config's own gains.")]


@app.command()
def frf(
    source: SourceArgument,
    set_: SetOption = None,
    averages: Annotated[int, typer.Option(metavar="N", min=8, help="Windows of 4.096 s, half overlapping.")] = 50,
    motor: MotorOption = 1,
    rms: RmsOption = None,
    speed: SpeedOption = None,
    band: BandOption = None,
    per_ampere: AmpereOption = False,
    keep_law: KeepOption = False,
    out: OutOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
) -> None:
    """Sensitivity from band-limited noise at constant speed, and the process derived from it (thesis 8.1).

    Exit code 3 where the record is too short, the coherence too low, a drive saturates or the loop is not stable.

    Examples:

      rtctl identify frf ivu --plot frf.png

      rtctl identify frf runs/noise --band 1:60 --json
    """
    from rtctl.identify import experiment, sensitivity

    records = sources.records(
        source, set_, out, json,
        lambda config: experiment.noise(
            config, averages, motor=motor, rms=_volts(rms), speed=_speed(config, speed), keep_law=keep_law
        ),
    )  # fmt: skip
    sources.say_on_stderr(json)("estimating")
    result = sensitivity.identify(records, _band(band))
    if per_ampere:
        result = result._replace(frf=result.frf.without_drive(_config(records)))
    if plot is not None:
        from rtctl.identify import frf_figures
        from rtctl.trace.plot import save

        save(frf_figures.sensitivity(result), plot)
    if json:
        common.print_json(_sensitivity_json(result))
    else:
        typer.echo("\n".join(_sensitivity_table(result)))


@app.command()
def multisine(
    source: SourceArgument,
    set_: SetOption = None,
    realisations: Annotated[int, typer.Option(metavar="N", min=2, help="Runs, each with other phases.")] = 4,
    periods: Annotated[
        int, typer.Option(metavar="N", min=2, help="Periods in a stretch, beside one for the transient.")
    ] = 4,
    motor: MotorOption = 1,
    rms: RmsOption = None,
    speed: SpeedOption = None,
    band: BandOption = None,
    per_ampere: AmpereOption = False,
    keep_law: KeepOption = False,
    out: OutOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
) -> None:
    """Best linear approximation by an odd random-phase multisine, with its noise and its odd and even distortion.

    With recordings: one bundle for each realisation.

    Examples:

      rtctl identify multisine ldu --plot bla.png

      rtctl identify multisine runs/ms/01 runs/ms/02 runs/ms/03
    """
    from rtctl.identify import best_linear, experiment

    records = sources.records(
        source, set_, out, json,
        lambda config: experiment.multisine(
            config, realisations, periods, motor=motor, rms=_volts(rms), speed=_speed(config, speed), keep_law=keep_law
        ),
    )  # fmt: skip
    result = best_linear.identify(records, _band(band))
    if per_ampere:
        result = result._replace(frf=result.frf.without_drive(_config(records)))
    if plot is not None:
        from rtctl.identify import frf_figures
        from rtctl.trace.plot import save

        save(frf_figures.best_linear(result), plot)
    if json:
        common.print_json(_best_linear_json(result))
    else:
        typer.echo("\n".join(_best_linear_table(result)))


@app.command()
def fit(
    source: SourceArgument,
    set_: SetOption = None,
    model: Annotated[
        str | None,
        typer.Option("--model", metavar="CONFIG", help="Model to start from; the recording's if absent."),
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option(
            "--free", metavar="NAME", help="Parameter to fit, e.g. J_m or c1; the usual ones if absent. Repeatable."
        ),
    ] = None,
    both: Annotated[bool, typer.Option("--both", help="Reel unit, with a CONFIG: excite each motor in turn.")] = False,
    realisations: Annotated[int, typer.Option(metavar="N", min=2, help="Runs, each with other phases.")] = 4,
    motor: MotorOption = 1,
    rms: RmsOption = None,
    band: BandOption = None,
    out: OutOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
) -> None:
    """Fit the machine's model and its delay to the frequency response, weighted by its confidence (8.2).

    With recordings: those of `frf` or `multisine`, grouped by excitation, motor and radii.

    Examples:

      rtctl identify fit ivu --plot fit.png

      rtctl identify fit runs/ms/01 runs/ms/02 --free J_m --free c --json
    """
    from rtctl.identify import experiment, model_fit

    def plan(config: Any) -> list[Any]:
        motors = (1, 2) if both else (motor,)
        return [e for m in motors for e in experiment.multisine(config, realisations, motor=m, rms=_volts(rms))]

    records = sources.records(source, set_, out, json, plan)
    frfs = _responses(records)
    start = common.load_config(model, None) if model is not None else _config(records)
    result = model_fit.fit(frfs, start, free, _band(band))
    if plot is not None:
        from rtctl.identify import frf_figures
        from rtctl.trace.plot import save

        save(frf_figures.model_fit(result), plot)
    if json:
        common.print_json(_fit_json(result))
    else:
        typer.echo("\n".join(_fit_table(result)))


def _config(records: list[Any]) -> Any:
    return records[0].config


def _responses(records: list[Any]) -> list["Frf"]:
    """Frequency responses, one for each excitation, motor and pair of radii among the records."""
    from rtctl.config.errors import UserError
    from rtctl.identify import best_linear, sensitivity
    from rtctl.identify.frf import motor_of
    from rtctl.machines.profile import REELS

    groups: dict[Any, list[Any]] = {}
    for record in records:
        radius = record.config.radius.model_dump_json() if record.profile.has(REELS) else ""
        groups.setdefault((record.config.excitation.kind, motor_of(record), radius), []).append(record)
    found = []
    for (kind, _, _), group in groups.items():
        if kind not in ("noise", "multisine"):
            raise UserError(f"{group[0].source}: excitation.kind is {kind}; a response takes noise or a multisine")
        found.append(sensitivity.identify(group).frf if kind == "noise" else best_linear.identify(group).frf)
    return found


def _band(text: str | None) -> tuple[float, float] | None:
    from rtctl.config.errors import UserError

    if text is None:
        return None
    low, _, high = text.removesuffix("Hz").partition(":")
    try:
        band = float(low.removesuffix("Hz")), float(high)
    except ValueError:
        raise UserError(f"--band {text}: write the ends in Hz with a colon, e.g. 1:60") from None
    if not 0 <= band[0] < band[1] < float("inf"):
        raise UserError(f"--band {text}: the first end must be below the second")
    return band


def _volts(text: str | None) -> float | None:
    return None if text is None else positive_si(text, "--rms", "V", "0.5V")


def _speed(config: Any, text: str | None) -> float | None:
    from rtctl.machines.profiles import profile_of

    unit, example = ("rad/s", "2rad/s") if profile_of(config.kind).unit == "rad" else ("m/s", "5mm/s")
    return None if text is None else positive_si(text, "--speed", unit, example)


def _pick(f: Any) -> Any:
    """Indices of about ROWS lines, evenly spaced in the logarithm of the frequency."""
    import numpy as np

    return np.unique([int(np.argmin(np.abs(np.log(f / x)))) for x in np.geomspace(f[0], f[-1], ROWS)])


def _db(x: Any) -> float:
    import math

    return 20 * math.log10(abs(x)) if abs(x) > 0 else float("nan")


def _degrees(x: Any) -> float:
    import cmath
    import math

    return math.degrees(cmath.phase(x))


def _unit(frf: "Frf") -> str:
    from rtctl.machines.profiles import profile_of

    return f"{profile_of(frf.kind).unit}/{'A' if frf.per_ampere else 'V'}"


def _sensitivity_table(result: "Sensitivity") -> list[str]:
    import numpy as np

    frf = result.frf
    lines = [
        f"{result.averages} averages, H_p carried at {len(frf.f)} of {len(result.f)} lines, "
        f"{frf.f[0]:.3g} to {frf.f[-1]:.3g} Hz",
        f"{'Hz':>9}{'|S| dB':>9}{'coherence':>11}{f'|H_p| dB {_unit(frf)}':>19}{'phase deg':>11}{'sd %':>8}",
    ]
    for i in _pick(frf.f):
        k = int(np.argmin(np.abs(result.f - frf.f[i])))
        lines.append(
            f"{frf.f[i]:9.3f}{_db(result.S[k]):9.2f}{result.coherence[k]:11.4f}{_db(frf.H[i]):19.2f}"
            f"{_degrees(frf.H[i]):11.1f}{100 * frf.relative[i]:8.2f}"
        )
    return lines


def _best_linear_table(result: "BestLinear") -> list[str]:
    import numpy as np

    frf = result.frf
    lines = [
        f"{result.realisations} realisations of {result.periods} periods, {len(frf.f)} lines, "
        f"{frf.f[0]:.3g} to {frf.f[-1]:.3g} Hz; levels in dB of the response",
        f"{'Hz':>9}{f'|G| dB {_unit(frf)}':>17}{'phase deg':>11}{'sd':>8}{'noise':>8}{'odd':>8}{'even':>8}",
    ]
    for i in _pick(frf.f):
        size = abs(result.G[i])
        even = np.interp(result.f[i], result.f_even, result.even) if len(result.f_even) else float("nan")
        levels = (result.total[i], result.noise[i], result.odd[i], even)
        lines.append(
            f"{frf.f[i]:9.3f}{_db(frf.H[i]):17.2f}{_degrees(frf.H[i]):11.1f}"
            + "".join(f"{_db(level / size):8.1f}" if level > 0 else f"{'-':>8}" for level in levels)
        )
    return lines


def _fit_table(result: "Fit") -> list[str]:
    lines = [
        f"{result.lines} lines, {result.band[0]:g} to {result.band[1]:g} Hz, misfit {result.chi2:.2f} of the noise",
        f"{'':8}{'value':>12}{'95 % from':>12}{'to':>12}  unit",
    ]
    for name, e in {**result.parameters, "tau": result.tau, "K_p": result.K_p}.items():
        lines.append(f"{name:8}{e.value:12.4g}{e.low:12.4g}{e.high:12.4g}  {e.unit}")
    return lines


def _complex(x: Any) -> dict[str, list[float]]:
    return {"re": x.real.tolist(), "im": x.imag.tolist()}


def _frf_json(frf: "Frf") -> dict[str, Any]:
    return {
        "f": frf.f.tolist(), "H": _complex(frf.H), "sd": frf.sd.tolist(), "unit": _unit(frf), "motor": frf.motor,
        "R1": frf.R1, "R2": frf.R2,
    }  # fmt: skip


def _sensitivity_json(result: "Sensitivity") -> dict[str, Any]:
    return {
        "averages": result.averages, "f": result.f.tolist(), "S": _complex(result.S),
        "coherence": result.coherence.tolist(), "S_sd": result.S_sd.tolist(), "frf": _frf_json(result.frf),
    }  # fmt: skip


def _best_linear_json(result: "BestLinear") -> dict[str, Any]:
    return {
        "realisations": result.realisations, "periods": result.periods, "frf": _frf_json(result.frf),
        "noise": result.noise.tolist(), "total": result.total.tolist(), "odd": result.odd.tolist(),
        "f_even": result.f_even.tolist(), "even": result.even.tolist(),
    }  # fmt: skip


def _fit_json(result: "Fit") -> dict[str, Any]:
    estimates = {**result.parameters, "tau": result.tau, "K_p": result.K_p}
    return {
        "parameters": {name: e._asdict() for name, e in estimates.items()},
        "chi2": result.chi2, "lines": result.lines, "band": list(result.band),
        "correlation": result.correlation.tolist(), "frfs": [_frf_json(frf) for frf in result.frfs],
    }  # fmt: skip
