"""The case of a bundle: what the owner of the machine believes, in the exchange format, with the full config beside.

Source: the exchange format for recordings of two-reel units, linear drives and axes (docs/bundle.md).
"""

import math
import platform
import sys
from typing import Any

import numba
import numpy as np

from rtctl import __version__
from rtctl.drivers import l292
from rtctl.loop import generate
from rtctl.machines import CONFIGS, Machine, described
from rtctl.machines.base import DESCRIBED
from rtctl.own.files import is_own
from rtctl.own.plant import own_plants
from rtctl.plants import axis, ivu, ldu
from rtctl.sources import sources_hash

TENSION_NOTE = (
    "Law: recompute it from `config` with the rtctl of `versions`; `ref`, `w` and the counts are its only inputs. "
    "truth_ columns, where there are any, are what only an emulator knows."
)


def describe(machine: Machine, made: generate.Generated) -> dict[str, Any]:
    """case.json of a recording of this machine, with the model that its config believes in and no hidden term."""
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
    if own is not None and own.source is not None:  # its equations are not those of the format: told as a bare machine
        config = config.model_copy(update={"plant": CONFIGS[machine.kind].model_fields["plant"].default})
        common["notes"] = f"{TENSION_NOTE} The emulated machine was {own.source.spec}, in `config.own`."
    case = {**common, **{"ivu": _ivu, "ldu": _ldu, "axis": _axis, DESCRIBED: _described}[machine.kind](config)}
    if own is not None:
        case["parameters"] = {}
    return {**case, "controller_known": case["controller"]["kind"] != "unknown"}


def _given(settings: Any) -> dict[str, float]:
    return {k: v for k, v in settings.model_dump().items() if isinstance(v, (int, float)) and v is not None}


def _ivu(config: Any) -> dict[str, Any]:
    law = config.law
    w, zeta = l292.second_order(config.plant.driver)[1:3]
    parameters = _given(ivu.parameters(config.plant))
    if not config.plant.follow_tape:
        parameters["d_tape"] = 0.0
    return {
        "parameters": parameters,
        "sensors": {
            "capstan_counts_per_rev": config.sensors.capstan.lines * config.sensors.capstan.multiply,
            "reel_counts_per_rev": config.sensors.reel1.pulses,
        },
        "drive": {
            "amp_per_volt": [law.tension.amp_per_volt, law.tension.amp_per_volt],
            "limit_volt": law.limit.high,
            "dac_bits": 12,
            "bandwidth_hz": w / (2 * math.pi),
            "damping": zeta,
        },
        "controller": _position(law)
        | {
            "tension_N": law.tension.F_t,
            "friction_Nm": law.friction.motor1.tau_C,
            "allocation": law.allocation.kind,
        },
    }


def _position(law: Any) -> dict[str, Any]:
    p = law.position
    kind = getattr(p, "kind", "pd")
    if is_own(kind):
        return {"kind": "unknown"}
    if kind == "pd":
        return {"kind": "pd", "P": p.gain, "D": p.gain * p.tau_d, "derivative_filter_hz": p.derivative_filter}
    return {"kind": kind, **p.model_dump(mode="json", exclude={"kind"})}


def _ldu(config: Any) -> dict[str, Any]:
    parameters = ldu.parameters(config.plant)
    return {
        "parameters": {**_given(parameters), "N": parameters.R_t / parameters.R_s},
        "sensors": {
            "encoder_counts_per_rev": config.sensors.encoder.lines * config.sensors.encoder.multiply,
            "scale_m_per_count": config.sensors.scale.pitch,
        },
        "drive": {
            "amp_per_volt": [0.1],
            "limit_volt": config.law.limit.high,
            "dac_bits": 12,
            "dac_range_volt": 10.0,
            "bandwidth_hz": config.plant.bandwidth,
            "damping": config.plant.damping,
        },
        "controller": _position(config.law),
    }


def _described(config: Any) -> dict[str, Any]:
    """The description, which is the nominal model, in SI; the recorded command is what acted on it."""
    parts = described.parts_of(config)
    return {
        "format": 2,
        "machine": config.machine.model_dump(mode="json", exclude_unset=True),
        "tolerance": {"default": 0.15},
        "loop": {"feedback": parts.feedback, "drive": parts.drive, "unit": parts.unit, "command": parts.command},
        "controller": {"kind": "unknown"},
    }


def _axis(config: Any) -> dict[str, Any]:
    p = axis.AxisParameters(**config.plant.parameters.model_dump())
    return {
        "parameters": _given(p),
        "sensors": {"x_resolution_m": config.encoder.pitch},
        "drive": {"newton_per_volt": p.K, "limit_volt": config.law.limit.high},
        "controller": _position(config.law),
    }
