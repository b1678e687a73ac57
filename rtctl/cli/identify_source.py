"""Records for an experiment: from bundles, or from playing the experiment on the machine of a config."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common

SourceArgument = Annotated[
    list[str],
    typer.Argument(metavar="BUNDLE...|CONFIG", help="Recordings of this experiment, or a config that runs it first."),
]
OutOption = Annotated[
    Path | None,
    typer.Option(
        "--out", "-o", metavar="DIR", help="With a CONFIG: keep the recordings here; a real machine's are always kept."
    ),
]
PlotOption = Annotated[Path | None, typer.Option("--plot", metavar="FILE", help="Draw the result into a PNG.")]


def are_bundles(words: list[str]) -> bool:
    """Whether all words are folders. Raises UserError where some are, or where two configs are given."""
    from rtctl.config.errors import UserError

    folders = [Path(word).is_dir() for word in words]
    if all(folders):
        return True
    if any(folders) or len(words) > 1:
        odd = words[folders.index(False)]
        raise UserError(f"{odd} is not a folder: give bundles, or one config that plays the experiment")
    return False


def load(words: list[str]) -> list[Any]:
    """Bundles of the folders `words`."""
    from rtctl.trace.bundle import load_bundle

    return [load_bundle(word) for word in words]


def play(config: Any, experiments: list[Any], out: Path | None, say: Callable[[str], None]) -> list[Any]:
    """Records of `experiments`, pairs of config and duration in s, played one after another.

    Emulated machines run on virtual time in this process. With `out`, and always with an external plant, a daemon
    session plays each experiment into its own bundle. Raises UserError where the machine cannot be run; the caller
    checks each record for trips.
    """
    from rtctl.config.errors import UserError
    from rtctl.config.load import set_path
    from rtctl.trace.bundle import load_bundle

    emulated = config.link.spawns
    folder = out if out is not None else None if emulated else common.default_folder(config.name)
    found: list[Any] = []
    for i, experiment in enumerate(experiments):
        one, seconds = experiment
        if emulated:
            one = set_path(one, "loop.mode", "fused")
        say(f"playing {i + 1} of {len(experiments)}, {seconds:.0f} s of the machine's time")
        if folder is None:
            from rtctl.loop import fused

            try:
                found.append(fused.run(one, seconds))
            except ValueError as error:
                raise UserError(f"{config.name}: {error}") from error
            continue
        from rtctl.daemon.session import Session, whole

        bundle = folder / f"{i + 1:02}"
        whole(Session(one, bundle, seconds, arm=True, say=lambda _: None).run())
        found.append(load_bundle(bundle))
    return found


def say_on_stderr(json: bool) -> Callable[[str], None]:
    """Function that prints progress on standard error; silent with `json`."""
    return (lambda text: None) if json else (lambda text: typer.echo(text, err=True))


def records(
    words: list[str], set_: list[str] | None, out: Path | None, json: bool, plan: Callable[[Any], list[Any]]
) -> list[Any]:
    """Records of bundles, or of the experiments (config, seconds) that `plan` makes of one config, played.

    Raises UserError where an option of a CONFIG is given with recordings.
    """
    from rtctl.config.errors import UserError
    from rtctl.identify.records import take_all

    if are_bundles(words):
        for option, given in (("--set", set_), ("--out", out)):
            if given:
                raise UserError(f"{option} goes with a CONFIG, not with recordings")
        return take_all(load(words))
    from rtctl.own import files

    config = common.load_config(words[0], set_)
    files.refuse_plant(config, f"{words[0]}: ")
    return take_all(play(config, plan(config), out, say_on_stderr(json)))


def positive_si(text: str, option: str, unit: str, example: str) -> float:
    """Positive quantity in SI. Raises UserError with the option and an example."""
    from rtctl.config.errors import UserError
    from rtctl.config.units import to_si

    value, given = common.quantity_of(text, option, example)
    try:
        si = float(to_si(f"{value} {given}", unit) if given else value)
    except ValueError as error:
        raise UserError(f"{option} {text}: {error}") from None
    if si <= 0:
        raise UserError(f"{option} {text}: must be above 0")
    return si
