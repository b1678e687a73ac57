"""`rtctl tune CONFIG`: a law for the machine that the config describes, and the reasons for every number."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import ConfigArgument, JsonOption, SetOption

app = typer.Typer(add_completion=False)


@app.command()
def tune(
    config: ConfigArgument,
    bandwidth: Annotated[
        float | None,
        typer.Option(
            "--bandwidth",
            metavar="HZ",
            help="Bandwidth to reach; 2 Hz ivu, 50 Hz ldu, 5 Hz axis if absent; of a described machine "
            "the fastest that keeps the margins.",
        ),
    ] = None,
    damping: Annotated[float, typer.Option("--damping", metavar="ZETA", help="Damping of a PD loop.")] = 1.0,
    gm: Annotated[
        float | None, typer.Option("--gm", metavar="DB", help="Least gain margin; 6 dB, 11 dB on the ldu if absent.")
    ] = None,
    pm: Annotated[
        float | None, typer.Option("--pm", metavar="DEG", help="Least phase margin; 45, 60 on the ldu if absent.")
    ] = None,
    method: Annotated[
        str,
        typer.Option(
            "--method", metavar="NAME", help="usual, or lq: state feedback from an observer, of a described machine."
        ),
    ] = "usual",
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE.yaml", help="Tuned config; NAME-tuned.yaml if absent.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE.png", help="Picture; beside the config if absent.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over files that exist.")] = False,
    set_: SetOption = None,
    json: JsonOption = False,
) -> None:
    """Tune the law of a config on the model in its `plant`: PD with a gain schedule over the reel radii (ivu), lead-lag
    with notches and a low-pass (ldu), or PD (axis). A described machine gets PD or PI; with --method lq it gets state
    feedback with integral action from an observer of the whole machine.
    Writes the tuned config with the reasons as comments, and a picture of Bode plot, Nyquist plot and step response
    before and after.

    Exit code 3 where the initial loop is unstable or the margins cannot be kept.

    Examples:

      rtctl tune ivu --bandwidth 2 -o tuned.yaml

      rtctl tune belt.yaml -o tuned.yaml

      rtctl tune belt.yaml --method lq -o tuned.yaml

      rtctl tune ldu --set sensors.feedback=scale --gm 11 --pm 60
    """
    from rtctl.design import tune as design
    from rtctl.machines.profile import REELS
    from rtctl.machines.profiles import profile_of

    settings = common.load_config(config, set_)
    common.machine_of(settings)
    file = out or Path(f"{settings.name}-tuned.yaml")
    picture = plot or file.with_suffix(".png")
    pictures = [
        picture,
        *([picture.with_stem(f"{picture.stem}-radii")] if profile_of(settings.kind).has(REELS) else []),
    ]
    check_files(file, pictures, force)
    found = design.tune(settings, bandwidth, damping, gm, pm, method)
    header = f"{settings.name}, tuned by `rtctl tune`.\nbefore: {design.words(found.before)}\n"
    header += f"after:  {design.words(found.after)}"
    write(file, design.written(found, header))
    draw(settings, found, pictures)
    if json:
        common.print_json(as_json(found, file, pictures))
        return
    typer.echo(f"before   {design.words(found.before)}")
    typer.echo(f"after    {design.words(found.after)}")
    for reason in found.reasons:
        typer.echo(f"  {reason.path:32} {reason.words}")
    typer.echo("  ".join(map(str, [file, *pictures])))


def check_files(file: Path, pictures: list[Path], force: bool) -> None:
    """Raise UserError, before the tuning, where an output file cannot be written."""
    from rtctl.config.errors import UserError

    if file.suffix not in (".yaml", ".yml"):
        raise UserError(f"--out {file}: a config is YAML; name it {file.with_suffix('.yaml')}")
    if pictures[0].suffix.lower() != ".png":
        raise UserError(f"--plot {pictures[0]}: the picture is a PNG; name it {pictures[0].with_suffix('.png')}")
    for option, path in (("--out", file), *(("--plot", picture) for picture in pictures)):
        if not path.parent.is_dir():
            raise UserError(f"{option} {path}: the folder {path.parent} does not exist")
        if path.exists() and not force:
            raise UserError(f"{option} {path}: exists; give another name, or --force")


def write(file: Path, text: str) -> None:
    """Write the config. Raises UserError where it cannot be written."""
    from rtctl.config.errors import UserError
    from rtctl.config.files import write_text

    try:
        write_text(file, text)
    except OSError as error:
        raise UserError(f"--out {file}: cannot be written: {error.strerror}") from None


def draw(settings: Any, found: Any, pictures: list[Path]) -> None:
    """Draw the loops before and after, and the maps over the radii where there are any."""
    from rtctl.design import figures
    from rtctl.trace.plot import save

    save(figures.loops({**({"before": settings} if found.before else {}), "after": found.config}), pictures[0])
    for path in pictures[1:]:
        save(figures.radii(found.maps), path)


def as_json(found: Any, file: Path, pictures: list[Path]) -> dict[str, Any]:
    """JSON object of a result."""
    return {
        "config": str(file),
        "plots": [str(picture) for picture in pictures],
        "before": None if found.before is None else found.before._asdict(),
        "after": found.after._asdict(),
        "reasons": [reason._asdict() for reason in found.reasons],
    }
