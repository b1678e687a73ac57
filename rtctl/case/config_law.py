"""Law of recordings by rtctl, from the config in case.json; `controller` of the exchange format holds a part of it.

Code that came with a recording is never run, so a law in a file of the user is unknown here.
"""

from typing import Any, NamedTuple

from pydantic import ValidationError

from rtctl.case.unsaid import unsaid
from rtctl.own.files import OwnError


class ConfigLaw(NamedTuple):
    """Law that the config defines completely."""

    kind: str  # of the position law
    config: Any  # checked settings of the machine


class UnsaidLaw(NamedTuple):
    """Law of a config that LawParams cannot hold."""

    kind: str
    parts: tuple[str, ...]  # names of the parts that LawParams has no place for


def config_law(config: Any) -> ConfigLaw | UnsaidLaw | None:
    """Law of a bundle's `config`; None where there is no config or this version of rtctl cannot read it."""
    from rtctl import machines  # slow to import, and needed only with a config
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
