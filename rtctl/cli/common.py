"""Options and conversions that commands share."""

import re
from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.config.errors import UserError, nearest
from rtctl.config.units import convert

SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change one key of the config, e.g. law.position.gain=20. Repeatable."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]
NameOption = Annotated[
    str | None, typer.Option("--name", "-n", help="Name of the machine (its config's `name`); needed where several run.")
]

DURATION = re.compile(r"\s*([-+0-9.eE]+)\s*([a-z]*)\s*")


def load_config(path: str, overrides: list[str] | None) -> Any:
    """Settings of a machine, of whichever kind its `machine` key says."""
    from rtctl import machines
    from rtctl.config.load import load_settings
    from rtctl.config.yaml_file import find, load_yaml

    document = load_yaml(find(path))
    kind = document.data.get("machine") if isinstance(document.data, dict) else None
    if kind not in machines.CONFIGS:
        near = nearest(str(kind), machines.CONFIGS) if kind else None
        line = document.line(("machine",)) if kind else None
        where = f"{path}:{line}" if line else path
        known = ", ".join(machines.CONFIGS)
        raise UserError(
            f"{where}: machine: " + (f"'{kind}' is not one of {known}" if kind else f"missing; it is one of {known}")
            + (f"; did you mean '{near}'?" if near else "")
        )  # fmt: skip
    return load_settings(path, machines.CONFIGS[kind], overrides or [])


def with_reference(config: Any, path: str | None) -> Any:
    """The config with the reference of another file, in the machine's own units."""
    if path is None:
        return config
    from rtctl.config.load import load_settings

    model = type(config).model_fields["reference"].annotation
    assert model is not None
    return config.model_copy(update={"reference": load_settings(path, model, [])})


def with_loop(config: Any, mode: str | None, link: str | None) -> Any:
    """The config with another time mode or link."""
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


def seconds(text: str | None, option: str) -> float | None:
    """A duration such as 12s, 200ms or 1.5h; a bare number is seconds."""
    if text is None:
        return None
    match = DURATION.fullmatch(text)
    try:
        if match is None:
            raise ValueError
        value = convert(float(match[1]), match[2] or "s", "s")
    except ValueError:
        raise UserError(f"{option} {text}: not a duration; write e.g. 12s, 200ms or 1h") from None
    if value <= 0:
        raise UserError(f"{option} {text}: must be more than nothing")
    return value


def quantity_of(text: str, option: str) -> tuple[float, str | None]:
    """A number with its unit, written together or apart: 20mm/s, 1.5 rad."""
    match = re.fullmatch(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*([A-Za-z/]*)\s*", text)
    if match is None:
        raise UserError(f"{option} {text}: not a number with a unit; write e.g. 20mm/s")
    return float(match[1]), match[2] or None


def client(name: str | None) -> Any:
    """A client of the machine that runs; the only one, or the one named."""
    from rtctl.daemon.client import Client
    from rtctl.daemon.server import find_endpoint, runtime_dir

    if name is None:
        folder = runtime_dir()
        running = sorted(p.name.removesuffix(".command") for p in folder.glob("*.command"))
        if not running:
            raise UserError("no machine runs here; start one with `rtctl run CONFIG`")
        if len(running) > 1:
            raise UserError(f"several machines run: {', '.join(running)}; say which with --name")
        name = running[0]
    elif "://" in name:
        return Client(name)
    return Client(find_endpoint(name, "command"))


def print_json(value: Any) -> None:
    """One JSON object on standard output."""
    import json

    typer.echo(json.dumps(value))


def default_folder(name: str) -> Path:
    """Where a run's bundle goes when nobody says: runs/NAME-DATE-TIME, never one that exists."""
    from datetime import datetime

    base = Path("runs") / f"{name}-{datetime.now().strftime('%Y%m%d-%H%M%S')}"
    folder, number = base, 2
    while folder.exists():
        folder, number = base.with_name(f"{base.name}-{number}"), number + 1
    return folder
