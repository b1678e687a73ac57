"""Command group that imports the module of a command when the command is used."""

import importlib
from typing import Any

import typer
from typer.core import TyperGroup

from rtctl.config.errors import UserError, nearest


class LazyGroup(TyperGroup):
    """Command group with lazy imports; a subclass lists its commands in `modules`."""

    modules: dict[str, str] = {}  # noqa: RUF012  name of each command, in the order of the help, and its module here
    what = "command"
    otherwise = "see rtctl --help"

    def list_commands(self, ctx: Any) -> list[str]:
        return list(self.modules)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in self.modules:
            if ctx.resilient_parsing:  # the shell completes a partial command
                return None
            near = nearest(cmd_name, self.modules)
            hint = f"did you mean '{near}'?" if near else self.otherwise
            raise UserError(f"no {self.what} '{cmd_name}'; {hint}")
        module = importlib.import_module(f"rtctl.cli.{self.modules[cmd_name]}")
        command = typer.main.get_command(module.app)
        command = getattr(command, "commands", {}).get(cmd_name, command)
        command.name = cmd_name
        return command
