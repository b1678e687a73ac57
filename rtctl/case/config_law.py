"""The law of our own recordings, by the config in case.json: `controller` of the exchange format says a part of it.

Code that came with the recording is never run, so the law of an own file is not known here.
"""

from typing import Any, NamedTuple

from pydantic import ValidationError

from rtctl.case.unsaid import unsaid
from rtctl.own.files import OwnError


class ConfigLaw(NamedTuple):
    """A law that the config says completely."""

    kind: str  # of the position law
    config: Any  # checked settings of the machine


class UnsaidLaw(NamedTuple):
    """A law of a config that no LawParams can hold."""

    kind: str
    parts: tuple[str, ...]  # what there is no place for, in words


def config_law(config: Any) -> ConfigLaw | UnsaidLaw | None:
    """The law of a bundle's `config`; None where there is no config or this version of rtctl cannot read it."""
    from rtctl import machines  # slow to import, and of no use to what reads a case without a config
    from rtctl.own.model import without_code

    if not isinstance(config, dict) or config.get("machine") not in machines.CONFIGS:
        return None
    try:
        model, data = without_code(machines.CONFIGS[config["machine"]], config)
        settings = model.model_validate(data)
    except (OwnError, ValidationError):
        return None
    position = settings.law.position
    kind = str(position.get("kind") if isinstance(position, dict) else getattr(position, "kind", "pd"))
    parts = unsaid(settings, kind, config)
    return UnsaidLaw(kind, parts) if parts else ConfigLaw(kind, settings)
