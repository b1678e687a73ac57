"""Hides one effect in an emulated machine: which one, where and how large is drawn by a seed and told to nobody.

Sizes are the typical ranges of the terms, scaled to what the machine does in ordinary use (see `ordinary`). A term has
ranges of its own for this, `draws`, where the typical ones, given in plain units, would be far too much or too little
for a machine (an axis in metres, a shaft at 4000 rpm).
"""

from math import log, pi
from typing import Any

import numpy as np
from pydantic import ValidationError

from rtctl import machines
from rtctl.config.errors import UserError
from rtctl.config.load import set_path
from rtctl.diagnose.answer.nominal_duty import measure, use
from rtctl.machines.profile import SCALE
from rtctl.machines.profiles import profile_of
from rtctl.plants import physics
from rtctl.plants.physics import TERMS, Draw

TRIES = 100
TYPICAL = {  # what Term.scale says -> measure
    "": "one", "dry": "dry", "force": "force", "force/speed": "drag", "force/travel": "stiff", "travel": "travel",
    "speed": "speed", "stiffness": "stiffness", "stiffness/stretch^2": "cubic", "sample period": "tick",
    "inertia": "inertia", "largest command": "peak", "contact": "contact",
}  # fmt: skip


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
    term = TERMS[name]
    found = physics.nodes(term, config.kind) if term.tabled else ()
    if term.unsigned:  # a loop on a sensor without signs runs away
        found = tuple(node for node in found if node not in physics.having(config.kind, "sensor", "feedback"))
    return [node for node in found if not term.needs.stiffness or use(node, config).stiffness > 0.0]


def sized(name: str, node: str, config: Any, rng: np.random.Generator) -> dict[str, Any]:
    """An entry of `physics:` with its sizes drawn."""
    term = TERMS[name]
    typical = {k: Draw(low, high, TYPICAL[term.scale.get(k, "")]) for k, (low, high) in term.typical.items()}
    ranges = {**typical, **term.draws}
    entry: dict[str, Any] = {"term": name, "node": node}
    for key, span in ranges.items():
        if key in term.chosen or span.high == 0.0:
            continue
        value = span.low * np.exp(rng.random() * log(span.high / span.low)) * measure(span.measure, node, config)
        if span.signed and rng.random() < 0.5:
            value = -value
        entry[key] = float(f"{value:.4g}")
    if "phi" in term.settings.model_fields:
        entry["phi"] = round(rng.uniform(-pi, pi), 3)
    for key, words in term.chosen.items():
        entry[key] = words[rng.integers(len(words))]
    if "seed" in term.settings.model_fields:
        entry["seed"] = int(rng.integers(1, 1_000_000))
    profile = profile_of(config.kind)
    if "R_c" in term.settings.model_fields and profile.has(SCALE):
        entry["R_c"] = profile.plant.parameters(config.plant).R_c
    return entry
