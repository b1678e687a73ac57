"""`rtctl`: every command is a module of its own, imported when it is used, so that `rtctl status` starts at once."""

import importlib
import os
import sys
import traceback

import typer
from typer.core import TyperGroup

COMMANDS = {
    "run": "run",
    "build": "build",
    "plant": "plant",
    "check": "check",
    "schema": "schema",
    "status": "status",
    "setpoint": "setpoint",
    "capture": "capture",
    "get": "settings",
    "set": "settings",
    "arm": "switch",
    "disarm": "switch",
    "reset": "switch",
    "stop": "switch",
    "play": "switch",
    "physics": "physics",
    "trace": "trace",
    "keys": "keys",
}


class LazyGroup(TyperGroup):
    """Loads a command's module when that command is asked for."""

    def list_commands(self, ctx):  # type: ignore[no-untyped-def]
        return list(COMMANDS)

    def get_command(self, ctx, name):  # type: ignore[no-untyped-def]
        if name not in COMMANDS:
            from rtctl.config.errors import UserError, nearest

            near = nearest(name, COMMANDS)
            raise UserError(f"no command '{name}'" + (f"; did you mean '{near}'?" if near else "; see rtctl --help"))
        module = importlib.import_module(f"rtctl.cli.{COMMANDS[name]}")
        command = typer.main.get_command(module.app)
        return command.commands[name] if hasattr(command, "commands") and name in command.commands else command


app = typer.Typer(
    cls=LazyGroup, no_args_is_help=True, add_completion=True, help="Real-time controller daemon for motion hardware."
)


@app.callback()
def _root() -> None:
    pass


def main() -> None:
    """Entry point. Exit code 2 for the user's mistake, 3 for data that carry no answer, 1 for ours, 130 for Ctrl-C."""
    from rtctl.config.errors import NoAnswer, UserError

    try:
        app()
    except (UserError, NoAnswer) as error:
        print(f"rtctl: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as error:
        if os.environ.get("RTCTL_TRACEBACK"):
            traceback.print_exc()
        print(f"rtctl: internal error: {error!r}; RTCTL_TRACEBACK=1 shows where", file=sys.stderr)
        sys.exit(1)


if __name__ == "__main__":
    main()
