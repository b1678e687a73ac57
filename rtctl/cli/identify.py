"""`rtctl identify`: experiments on a machine that runs, an emulated one, or a recording. Each has a file of its own."""

import importlib
from typing import Any

import typer
from typer.core import TyperGroup

from rtctl.config.errors import UserError, nearest

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


class LazyExperiments(TyperGroup):
    """Loads an experiment's module when that experiment is asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        return list(EXPERIMENTS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in EXPERIMENTS:
            if ctx.resilient_parsing:  # the shell completes what is not yet a command
                return None
            near = nearest(cmd_name, EXPERIMENTS)
            hint = f"did you mean '{near}'?" if near else f"it is one of {', '.join(EXPERIMENTS)}"
            raise UserError(f"no experiment '{cmd_name}'; {hint}")
        module = importlib.import_module(f"rtctl.cli.{EXPERIMENTS[cmd_name]}")
        command = typer.main.get_command(module.app)
        command = getattr(command, "commands", {}).get(cmd_name, command)
        command.name = cmd_name
        return command


app = typer.Typer(cls=LazyExperiments, add_completion=False, no_args_is_help=True)


@app.callback()
def _identify() -> None:
    """Identify a machine: frequency response, model, friction, radii, drive and scale, from a BUNDLE or by playing the
    experiment on the machine of a CONFIG.
    """
