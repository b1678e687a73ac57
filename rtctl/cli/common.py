"""Options and conversions that commands share."""

import math
import os
import re
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from rtctl.cli import complete
from rtctl.config.errors import UserError, nearest

ConfigArgument = Annotated[
    str,
    typer.Argument(
        metavar="CONFIG",
        help="Config file, or the name of one that comes with rtctl: ivu, ldu, axis.",
        autocompletion=complete.configs,
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change one key, e.g. law.position.gain=20. Repeatable.",
        autocompletion=complete.keys,
    ),
]
ModeOption = Annotated[
    str | None, typer.Option("--mode", metavar="MODE", help="real, lockstep or fused; as in the config if absent.")
]
LinkOption = Annotated[
    str | None, typer.Option("--link", metavar="LINK", help="zmq or shm; as in the config if absent.")
]
ReferenceOption = Annotated[
    str | None,
    typer.Option(
        "--reference",
        metavar="FILE",
        help="Reference to play: a file, or one that comes with rtctl: steps.",
        autocompletion=complete.references,
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]
NameOption = Annotated[
    str | None,
    typer.Option(
        "--name",
        "-n",
        metavar="NAME",
        help="The machine's `name` or its endpoint, where several run.",
        autocompletion=complete.machines,
    ),
]

SECONDS = {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0}
DURATION = re.compile(r"\s*(\+?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*([a-z]*)\s*")
QUANTITY = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*([A-Za-z%][A-Za-z%/]*)?\s*")
NEGATIVE = re.compile(r"-[0-9.]")


class SignedCommand(TyperCommand):
    """A command whose arguments may be negative numbers, which would otherwise be taken for options."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if "--" not in args:
            first = next((i for i, word in enumerate(args) if NEGATIVE.match(word)), None)
            if first is not None:  # -5mm and the words of its unit go behind the options
                end = first + 1
                while end < len(args) and not args[end].startswith("-"):
                    end += 1
                args = [*args[:first], *args[end:], "--", *args[first:end]]
        return super().parse_args(ctx, args)


def load_config(path: str, overrides: list[str] | None) -> Any:
    """Validated settings of a config file; its `machine` key selects the settings class."""
    from rtctl import machines
    from rtctl.config.load import load_settings
    from rtctl.config.yaml_file import find, load_yaml

    file = find(path)
    document = load_yaml(file)
    kind = document.data.get("machine") if isinstance(document.data, dict) else None
    model = machines.class_of(document.data)
    if model is None:
        near = nearest(str(kind), machines.CONFIGS) if kind else None
        line = document.line(("machine",)) if kind else None
        where = f"{path}:{line}" if line else path
        known = ", ".join(machines.CONFIGS)
        wanted = f"{known}, or bodies, joints, drives and sensors"
        what = f"{kind!r:.60} is not one of {known}" if kind else f"missing; it is one of {wanted}"
        raise UserError(f"{where}: machine: {what}" + (f"; did you mean '{near}'?" if near else ""))
    return load_settings(file, model, overrides or [], machines.OWN)


def with_reference(config: Any, path: str | None) -> Any:
    """Copy of the config with the reference from the file `path`, in the machine's own units."""
    if path is None:
        return config
    from rtctl.config.load import load_settings
    from rtctl.config.yaml_file import find

    model = type(config).model_fields["reference"].annotation
    assert model is not None
    return config.model_copy(update={"reference": load_settings(find(path), model, [])})


def with_loop(config: Any, mode: str | None, link: str | None) -> Any:
    """Copy of the config with another time mode or link."""
    update: dict[str, Any] = {}
    if mode is not None:
        if mode not in ("real", "lockstep", "fused"):
            raise UserError(f"--mode {mode}: it is real, lockstep or fused")
        update["loop"] = config.loop.model_copy(update={"mode": mode})
    if link is not None:
        if link not in ("zmq", "shm"):
            raise UserError(f"--link {link}: it is zmq or shm")
        update["link"] = config.link.model_copy(update={"kind": link})
    return config.model_copy(update=update) if update else config


def machine_of(config: Any) -> Any:
    """Machine of a config, not compiled. Raises UserError where settings contradict each other."""
    from rtctl import machines
    from rtctl.own.files import OwnError

    try:
        return machines.build(config)
    except OwnError as error:
        raise UserError(str(error)) from error
    except ValueError as error:
        raise UserError(f"{config.name}: {error}") from error


def seconds(text: str | None, option: str) -> float | None:
    """Duration in s of a text such as 12s, 200ms or 1.5h; a bare number is in s."""
    if text is None:
        return None
    match = DURATION.fullmatch(text)
    try:
        if match is None or match[2] not in SECONDS:
            raise ValueError
        value = float(match[1]) * SECONDS[match[2]]
    except ValueError:
        raise UserError(f"{option} {text}: not a duration; write e.g. 12s, 200ms or 1h") from None
    if value <= 0 or not math.isfinite(value):
        raise UserError(f"{option} {text}: must be above 0 and finite")
    return value


def quantity_of(text: str, option: str, example: str = "20mm/s") -> tuple[float, str | None]:
    """Value and unit (None if absent) of a text such as 20mm/s or 1.5 rad."""
    match = QUANTITY.fullmatch(text)
    try:
        if match is None:
            raise ValueError
        return float(match[1]), match[2]
    except ValueError:
        raise UserError(f"{option} {text}: not a number with a unit; write e.g. {example}") from None


def client(name: str | None) -> Any:
    """Client of a running machine: the only one, or the machine or endpoint `name`."""
    from rtctl.daemon import keys
    from rtctl.daemon.client import Client
    from rtctl.daemon.server import find_endpoint

    if name is not None and "://" in name:
        return Client(name, curve=keys.client_curve() if keys.require_curve(name) else None)
    names = running()
    if name is None:
        if not names:
            raise UserError("no machine runs here; start one with `rtctl run CONFIG`")
        if len(names) > 1:
            raise UserError(f"several machines run: {', '.join(names)}; say which with --name")
        name = names[0]
    elif name not in names:
        near = nearest(name, names)
        there = f"there is {', '.join(names)}" if names else "start it with `rtctl run`"
        raise UserError(f"no machine '{name}' runs here; " + (f"did you mean '{near}'?" if near else there))
    where = find_endpoint(name, "command")
    if not os.access(where.removeprefix("ipc://"), os.W_OK):
        raise UserError(f"'{name}' runs, but this account may not command it: {where} is not writable for it")
    return Client(where)


def first_status(client: Any) -> dict[str, Any]:
    """First status of a daemon; waits while a daemon on this computer starts, and says once that it waits.

    Raises UserError where no daemon listens, or where a daemon on another computer does not answer.
    """
    from rtctl.daemon.client import CommandError, listens

    told = False
    while True:
        try:
            return client.call("status")
        except CommandError:
            raise
        except UserError:
            if not client.endpoint.startswith("ipc://") or not listens(client.endpoint):
                raise
        if not told:
            typer.echo("the daemon is there but does not answer yet: it compiles its tick, or hangs; waiting", err=True)
            told = True


def running() -> list[str]:
    """Names of the machines with a daemon that listens on the command socket."""
    from rtctl.daemon.client import listens
    from rtctl.daemon.server import SYSTEM_DIR, runtime_dir

    files = [path for folder in {runtime_dir(), SYSTEM_DIR} if folder.is_dir() for path in folder.glob("*.command")]
    return sorted({path.name.removesuffix(".command") for path in files if listens(f"ipc://{path}")})


def print_json(value: Any) -> None:
    """Print one JSON object on standard output; NaN (not measured) and infinity become null."""
    import json

    typer.echo(json.dumps(_finite(value)))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def default_folder(name: str) -> Path:
    """Folder of a run's bundle if none is given: runs/NAME-DATE-TIME, numbered where that exists."""
    from datetime import datetime

    base = Path("runs") / f"{name}-{datetime.now().strftime('%Y%m%d-%H%M%S')}"
    folder, number = base, 2
    while folder.exists():
        folder, number = base.with_name(f"{base.name}-{number}"), number + 1
    return folder
