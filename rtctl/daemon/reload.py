"""Reload of a config while its machine runs: settings that `rtctl set` could change are applied, others refused."""

from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from rtctl import machines
from rtctl.config.errors import UserError
from rtctl.config.fields import written
from rtctl.config.load import get_path
from rtctl.daemon.commands import SWITCHED
from rtctl.loop import generate

if TYPE_CHECKING:
    from rtctl.daemon.supervisor import Supervisor


def reload(supervisor: "Supervisor", fresh: Any) -> tuple[list[str], list[str]]:
    """Apply the settings that may change, at one tick. Returns applied paths, and sentences about refused settings.

    `fresh` are the settings of the file as it is now. Raises UserError where the new values contradict each other; then
    all old values stay.
    """
    old = supervisor.config
    if fresh.machine != old.machine:
        named = isinstance(fresh.machine, str) and isinstance(old.machine, str)
        what = f"'{fresh.machine}' instead of '{old.machine}'" if named else "another description"
        raise UserError(f"machine: {what} needs a restart")
    if type(fresh) is not type(old):
        raise UserError(f"own: {' '.join(sorted({**old.own, **fresh.own}))} is another text now; restart the machine")
    changed = differences(old, fresh)
    refused = [path for path in changed if path.split(".")[0] in SWITCHED]
    crossed = supervisor.bounds.crossed(fresh)
    beyond = [path for path in changed if any(p == path or p.startswith(f"{path}.") for p in crossed)]
    free = [path for path in changed if path not in refused and path not in beyond]
    fixed: list[str] = []
    if _rebuilds(supervisor, fresh, free):
        fixed = [path for path in free if _rebuilds(supervisor, fresh, [path])]
    taken = [path for path in free if path not in fixed]
    if taken:
        config = mixed(old, fresh, taken)
        for sentence in supervisor.bounds.crossed(config).values():
            raise UserError(sentence)
        machine = _built(config)
        if generate.source(machine, supervisor.link) != generate.source(supervisor.machine, supervisor.link):
            raise UserError(f"{', '.join(taken)}: together they need another tick; restart the machine")
        supervisor.commands.take_over(config, machine, {path: written(get_path(fresh, path)) for path in taken})
    sentences = [f"{path} cannot change while the machine runs; restart it" for path in refused]
    sentences += [crossed[p] for p in crossed if any(p == path or p.startswith(f"{path}.") for path in beyond)]
    sentences += [f"{path} changes the structure of the tick; restart the machine" for path in fixed]
    return taken, sentences


def differences(old: Any, new: Any, at: str = "") -> list[str]:
    """Dotted paths whose values differ. A list is one path, and so is a group of settings that changes its kind."""
    if type(old) is not type(new) or not hasattr(type(old), "model_fields"):
        return [] if type(old) is type(new) and old == new else [at]
    names = type(old).model_fields
    return [p for n in names for p in differences(getattr(old, n), getattr(new, n), f"{at}.{n}" if at else n)]


def mixed(old: Any, new: Any, paths: list[str]) -> Any:
    """Settings `old` with the values of `new` at `paths`. Raises UserError where the values contradict each other."""
    config = old
    for path in paths:
        config = _with(config, path.split("."), get_path(new, path))
    try:
        return type(old).model_validate(written(config))
    except ValidationError as error:
        raise UserError("; ".join(f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors())) from error


def _with(settings: Any, parts: list[str], value: Any) -> Any:
    fresh = value if len(parts) == 1 else _with(getattr(settings, parts[0]), parts[1:], value)
    return settings.model_copy(update={parts[0]: fresh})


def _rebuilds(supervisor: "Supervisor", fresh: Any, paths: list[str]) -> bool:
    """Whether these values change the code of the tick. False where they are invalid without other changes."""
    try:
        machine = _built(mixed(supervisor.config, fresh, paths))
    except UserError:
        return False
    return generate.source(machine, supervisor.link) != generate.source(supervisor.machine, supervisor.link)


def _built(config: Any) -> Any:
    try:
        return machines.build(config)
    except ValueError as error:
        raise UserError(str(error)) from error
