"""Hides one effect in an emulated machine: which one, where and how large is drawn by a seed and told to nobody.

Sizes are the library's typical ranges, scaled to what the machine does in ordinary use (see `ordinary`). A few ranges
are this table's own, where the library's, given in plain units, would be far too much or too little for a machine (an
axis in metres, a shaft at 4000 rpm).
"""

from math import log, pi
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from rtctl import machines
from rtctl.config.errors import UserError
from rtctl.config.load import set_path
from rtctl.diagnose.ordinary import measure, use
from rtctl.plants import ldu
from rtctl.plants.physics import TERMS

FEEDBACK = {"ivu": ("encoder",), "ldu": ("encoder",), "axis": ("sensor",)}  # a loop on a sensor without signs runs away
TRIES = 100


class Draw(NamedTuple):
    """Range of a parameter in units of a measure, drawn evenly in its logarithm; `signed`: either sign."""

    low: float
    high: float
    measure: str = "one"
    signed: bool = False


TYPICAL = {  # what Term.scale says -> measure
    "": "one", "dry": "dry", "force": "force", "force/speed": "drag", "force/travel": "stiff", "travel": "travel",
    "speed": "speed", "stiffness": "stiffness", "stiffness/stretch^2": "cubic", "sample period": "tick",
    "inertia": "inertia", "largest command": "peak", "contact": "contact",
}  # fmt: skip
OWN: dict[str, dict[str, Draw]] = {
    "friction.coulomb": {"F_C": Draw(0.4, 1.0, "dry")},
    "friction.presliding": {"z_s": Draw(2e-3, 2e-2, "travel")},
    "friction.asymmetry": {"a": Draw(0.1, 0.3, signed=True), "B_a": Draw(0.0, 0.0)},
    "transmission.backlash": {"gap": Draw(1.0, 5.0, "twist")},
    "transmission.slip": {"F_max": Draw(1.05, 1.5, "contact")},
    "transmission.creep": {"kappa": Draw(1e-3, 1e-2, "per_contact")},
    "structure.resonance": {
        "f_Hz": Draw(0.04, 0.2, "rate"), "mass": Draw(0.1, 0.4, "inertia"), "zeta": Draw(0.01, 0.1),
    },
    "structure.stiffening": {"c3": Draw(1.0, 5.0, "cubic")},
    "tape.slack": {"share": Draw(0.8, 1.0)},
    "load.imbalance": {"A": Draw(0.05, 0.3, "force"), "turn": Draw(1.0, 1.0, "turn")},
    "load.bump": {"F": Draw(0.2, 1.0, "force"), "at": Draw(0.02, 0.08, "travel"), "width": Draw(0.01, 0.05, "travel")},
    "drive.offset": {"offset": Draw(0.05, 0.3, "volts", signed=True)},
    "drive.deadband": {"band": Draw(0.05, 0.3, "volts")},
    "drive.gain_asymmetry": {"a": Draw(0.03, 0.2, signed=True)},
    "drive.saturation": {"limit": Draw(0.6, 0.9, "peak")},
    "drive.supply_sag": {"k": Draw(0.03, 0.15, "per_volt")},
    "drive.thermal": {"a": Draw(0.05, 0.4), "tau": Draw(3.0, 30.0), "V_ref": Draw(1.0, 1.0, "volts")},
    "timing.delay": {"extra": Draw(0.3, 1.5, "tick")},
    "timing.jitter": {"sigma": Draw(0.05, 0.3, "tick"), "rate": Draw(1.0, 1.0, "hertz")},
    "ripple.cogging": {"A": Draw(0.02, 0.3, "force"), "turn": Draw(1.0, 1.0, "turn")},
    "ripple.encoder": {"A": Draw(3e-4, 1e-2, "lever"), "turn": Draw(1.0, 1.0, "turn")},
    "ripple.reel": {"e": Draw(5e-5, 5e-4)},
    "ripple.capstan": {"a": Draw(1e-5, 1e-4)},
    "guide.thickness": {"A": Draw(2e-6, 3e-5), "wavelength": Draw(0.2, 1.0, "travel")},
    "guide.strip": {"longer": Draw(1e-5, 1e-4), "wavelength": Draw(0.2, 1.0, "travel")},
    "guide.dirt": {"A": Draw(5e-6, 5e-5), "at": Draw(0.02, 0.08, "travel"), "width": Draw(5e-3, 2e-2, "travel")},
    "sensor.missed_counts": {
        "each": Draw(3e-3, 3e-2, "lever", signed=True), "mark": Draw(0.02, 0.08, "travel"), "size": Draw(0.0, 0.0),
    },
    "sensor.rectified": {"share": Draw(0.5, 1.0)},
    "sensor.scale": {"relative": Draw(1e-3, 5e-3, signed=True)},
    "geometry.radius_change": {"d": Draw(1e-4, 1e-3)},
}  # fmt: skip
WORDS: dict[str, dict[str, tuple]] = {  # settings that are chosen rather than sized
    "friction.stribeck": {"form": ("gaussian", "exponential", "tustin")},
    "friction.presliding": {"form": ("dahl", "lugre")},
    "drive.deadband": {"form": ("shift", "cut", "floor")},
    "drive.lag": {"order": (1, 2)},
    "timing.jitter": {"form": ("gaussian", "uniform")},
    "ripple.cogging": {"per_turn": (3.0, 5.0, 7.0, 12.0, 24.0)},
    "load.bump": {"form": ("drag", "hill", "push")},
}


def conceal(config: Any, seed: int) -> tuple[Any, dict[str, Any]]:
    """The config with one more entry in `plant.physics`, and that entry. The same seed and config give the same one.

    Raises UserError where nothing can be hidden in this machine.
    """
    rng = np.random.default_rng([seed, *config.kind.encode()])
    names = [name for name in sorted(TERMS) if nodes(name, config)]
    if not names:
        raise UserError(
            f"{config.name}: effects are hidden in machines that come with the program, not in a described one"
        )
    at = len(config.plant.physics)
    for _ in range(TRIES):
        name = names[rng.integers(len(names))]
        choices = nodes(name, config)
        entry = sized(name, choices[rng.integers(len(choices))], config, rng)
        try:
            hidden = set_path(config, f"plant.physics.{at}", entry)
            machines.build(hidden)
        except (UserError, ValidationError, ValueError):
            continue  # too much for this machine
        return hidden, entry
    raise UserError(f"{config.name}: no effect of the library can be hidden in this machine")


def nodes(name: str, config: Any) -> list[str]:
    """Where an effect can be hidden in a machine without its loop running away at once."""
    found = TERMS[name].nodes.get(config.kind, ()) if TERMS[name].tabled else ()
    if name == "sensor.rectified":
        found = tuple(node for node in found if node not in FEEDBACK[config.kind])
    return [node for node in found if name != "structure.stiffening" or use(node, config).stiffness > 0.0]


def sized(name: str, node: str, config: Any, rng: np.random.Generator) -> dict[str, Any]:
    """An entry of `physics:` with its sizes drawn."""
    term = TERMS[name]
    own = OWN.get(name, {})
    typical = {k: Draw(low, high, TYPICAL[term.scale.get(k, "")]) for k, (low, high) in term.typical.items()}
    ranges = {**typical, **own}
    entry: dict[str, Any] = {"term": name, "node": node}
    for key, span in ranges.items():
        if key in WORDS.get(name, {}) or span.high == 0.0:
            continue
        value = span.low * np.exp(rng.random() * log(span.high / span.low)) * measure(span.measure, node, config)
        if span.signed and rng.random() < 0.5:
            value = -value
        entry[key] = float(f"{value:.4g}")
    if "phi" in term.settings.model_fields:
        entry["phi"] = round(rng.uniform(-pi, pi), 3)
    for key, words in WORDS.get(name, {}).items():
        entry[key] = words[rng.integers(len(words))]
    if "seed" in term.settings.model_fields:
        entry["seed"] = int(rng.integers(1, 1_000_000))
    if "R_c" in term.settings.model_fields and config.kind == "ldu":
        entry["R_c"] = ldu.parameters(config.plant).R_c
    return entry
