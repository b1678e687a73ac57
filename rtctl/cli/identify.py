"""`rtctl identify`: experiments on a running machine, an emulated machine, or a recording."""

import typer

from rtctl.cli.lazy import LazyGroup

# Name of each experiment, in the order of `rtctl identify --help`, and its module here. Modules import nothing heavy.
EXPERIMENTS = {
    "frf": "identify_frf",
    "multisine": "identify_frf",
    "fit": "identify_frf",
    "friction": "identify_bench",
    "radius": "identify_bench",
    "driver": "identify_bench",
    "scale": "identify_bench",
    "steps": "identify_bench",
}


class Experiments(LazyGroup):
    modules = EXPERIMENTS
    what = "experiment"
    otherwise = f"it is one of {', '.join(EXPERIMENTS)}"


app = typer.Typer(cls=Experiments, add_completion=False, no_args_is_help=True)


@app.callback()
def _identify() -> None:
    """Identify a machine: frequency response, model, friction, radii, drive and scale, from a BUNDLE or by playing the
    experiment on the machine of a CONFIG.
    """
