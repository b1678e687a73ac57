"""Hidden effect in an emulated machine: a seed draws term, node and size, and nothing reports them.

Sizes are the typical ranges of the terms, scaled to the nominal duty of the machine (see `nominal_duty`). A term has
ranges `draws` of its own where the typical ranges, given in plain units, are far too large or too small for a machine
(an axis in metres, a shaft at 4000 rpm).
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
    """Config with one more entry in `plant.physics`, and the entry. Equal seed and config give an equal entry.

    Raises UserError where nothing can be hidden in this machine.
    """
    rng = np.random.default_rng([seed, *config.kind.encode()])
    names = [name for name in sorted(TERMS) if nodes(name, config)]
    if not names:
        raise UserError(
            f"{config.name}: effects can be hidden only in a shipped machine (ivu, ldu, axis), not in a described one"
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
            continue  # the effect is too large for this machine
        return hidden, entry
    raise UserError(f"{config.name}: no effect of the library can be hidden in this machine")


def nodes(name: str, config: Any) -> list[str]:
    """Nodes at which an effect can be hidden without instability of the loop."""
    term = TERMS[name]
    found = physics.nodes(term, config.kind) if term.tabled else ()
    if term.unsigned:  # a loop on a sensor without signs is unstable
        found = tuple(node for node in found if node not in physics.having(config.kind, "sensor", "feedback"))
    return [node for node in found if not term.needs.stiffness or use(node, config).stiffness > 0.0]


def sized(name: str, node: str, config: Any, rng: np.random.Generator) -> dict[str, Any]:
    """Entry of `physics:` with drawn sizes, SI."""
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
