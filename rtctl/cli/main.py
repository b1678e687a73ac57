"""`rtctl`: every command is a module of its own, imported when it is used, so that `rtctl status` starts at once."""

import contextlib
import os
import sys
from collections.abc import Sequence
from typing import Annotated, Any

import typer

from rtctl.cli.lazy import LazyGroup
from rtctl.config.arithmetic import equal_digits
from rtctl.config.errors import NoAnswer, RunFailed, UserError
from rtctl.config.failures import told
from rtctl.config.isolated import isolate

# Name of each command, in the order of `rtctl --help`, and its module here. Modules import nothing heavy.
COMMANDS = {
    "run": "run",
    "build": "build",
    "plant": "plant",
    "check": "check",
    "schema": "schema",
    "status": "status",
    "scope": "scope",
    "watch": "watch",
    "foxglove": "foxglove",
    "setpoint": "setpoint",
    "capture": "capture",
    "get": "settings",
    "set": "settings",
    "arm": "switch",
    "disarm": "switch",
    "reset": "switch",
    "stop": "switch",
    "play": "switch",
    "fault": "fault",
    "identify": "identify",
    "tune": "tune",
    "reproduce": "reproduce",
    "diagnose": "diagnose",
    "improve": "improve",
    "trend": "trend",
    "simulate": "simulate",
    "replay": "replay",
    "prove": "prove",
    "physics": "physics",
    "new": "new",
    "trace": "trace",
    "import": "import_",
    "soak": "soak",
    "campaign": "campaign",
    "doctor": "doctor",
    "keys": "keys",
}
USAGE_ERROR: type[Exception] = typer.BadParameter.__bases__[0]  # typer's usage error, which typer does not export


class Commands(LazyGroup):
    modules = COMMANDS


app = typer.Typer(cls=Commands, add_completion=True, help="Real-time controller daemon for motion hardware.")


def _version(wanted: bool) -> None:
    if wanted:
        from rtctl import __version__

        typer.echo(f"rtctl {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        context.get_help()
        raise typer.Exit(2)


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit code of one call of `rtctl`; `arguments` default to those of the command line.

    1 for a run that tripped or an internal error, 2 for a mistake of the user or a refusal of the computer, 3 for data
    that support no answer, 130 for Ctrl-C.
    """
    if arguments is None:  # called as the program; a caller with arguments keeps its own sys.path
        isolate()
        equal_digits()
    try:
        code = app(arguments, prog_name="rtctl", standalone_mode=False) or 0
        sys.stdout.flush()  # a full disk is reported here; the interpreter's flush at exit has no message for it
        return code
    except (UserError, NoAnswer, RunFailed) as error:
        return _fail(str(error), error.exit_code)
    except USAGE_ERROR as error:
        return _fail(_usage(error), 2) if str(error) else 2  # empty: typer has shown the help instead
    except BrokenPipeError:
        _forget_output()
        return 1
    except (KeyboardInterrupt, typer.Abort):
        return 130
    except Exception as error:
        code, said = told(error)
        if code == 2:
            _forget_output()
        return _fail(said, code)


def _forget_output() -> None:
    """Discard buffered output where standard output accepts no more."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def _usage(error: Any) -> str:
    """Message for a mistake on the command line, in one line that names the help to read."""
    message = " ".join(error.format_message().split()).rstrip(".")
    context = getattr(error, "ctx", None)
    return f"{message[:1].lower()}{message[1:]}; see {context.command_path if context else 'rtctl'} --help"


def _fail(message: str, code: int) -> int:
    print(f"rtctl: {message}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
