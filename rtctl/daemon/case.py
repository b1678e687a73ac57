"""The case of a bundle: the nominal model of the machine in the exchange format, and its full config.

Source: the exchange format for recordings of two-reel units, linear drives and axes (docs/bundle.md).
"""

import platform
import sys
from typing import Any

import numba
import numpy as np

from rtctl import __version__
from rtctl.loop import generate
from rtctl.machines import CONFIGS, Machine, described
from rtctl.machines.base import DESCRIBED
from rtctl.machines.profiles import profile_of
from rtctl.own.plant import own_plants
from rtctl.sources import sources_hash

TENSION_NOTE = (
    "Law: recompute it from `config` with the rtctl of `versions`; `ref`, `w` and the counts are its only inputs. "
    "truth_ columns, where there are any, are what only an emulator knows."
)


def describe(machine: Machine, made: generate.Generated) -> dict[str, Any]:
    """case.json of a recording of this machine: the nominal model of its config, without hidden terms."""
    config = machine.config
    common = {
        **({} if machine.kind == DESCRIBED else {"plant": machine.kind}),
        "sample_rate": machine.rate,
        "delay_samples": 1.0 if config.loop.write == "next_tick" else 0.0,
        **({} if machine.kind == DESCRIBED else {"reaches": {"parameter_tolerance": 0.15, "radius_tolerance": 0.02}}),
        "notes": TENSION_NOTE,
        "config": config.model_dump(mode="json", exclude_unset=True),
        "seed": config.loop.seed,
        "versions": {
            "rtctl": __version__,
            "numba": numba.__version__,
            "numpy": np.__version__,
            "python": sys.version.split()[0],
            "machine": platform.machine(),
            "tick": made.path.stem,
            "sources": sources_hash(),
        },
    }
    own = own_plants.get(type(config.plant))
    if own is not None and own.source is not None:  # the format cannot express its equations
        config = config.model_copy(update={"plant": CONFIGS[machine.kind].model_fields["plant"].default})
        common["notes"] = f"{TENSION_NOTE} The emulated machine was {own.source.spec}, in `config.own`."
    case = {**common, **(profile_of(machine.kind).case or _described)(config)}
    if own is not None:
        case["parameters"] = {}
    return {**case, "controller_known": case["controller"]["kind"] != "unknown"}


def _described(config: Any) -> dict[str, Any]:
    """Case of a described machine, in SI: the description is the nominal model, the recorded command its input."""
    parts = described.parts_of(config)
    return {
        "format": 2,
        "machine": config.machine.model_dump(mode="json", exclude_unset=True),
        "tolerance": {"default": 0.15},
        "loop": {"feedback": parts.feedback, "drive": parts.drive, "unit": parts.unit, "command": parts.command},
        "controller": {"kind": "unknown"},
    }
