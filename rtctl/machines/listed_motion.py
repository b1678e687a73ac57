"""Mechanics of a shipped machine, for a feedforward along its reference."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rtctl.machines.profile import Model
from rtctl.machines.reference_motion import Mechanics
from rtctl.plants.graph.elements import Spot
from rtctl.plants.physics.place import place


def mechanics(config: Any, p: Any, plus: Model, minus: Model, inputs: Sequence[float] = ()) -> Mechanics:
    """Mechanics from the params `p` of the plant and its models for positive and negative commands; `inputs` are the
    inputs of the drives for one unit of command, where one command sets them all."""

    def place_of(entry: Any) -> Spot:
        spot = place(config.kind, entry.node)
        factor = float(getattr(p, spot.factor)) if spot.factor else 1.0
        return Spot(spot.node, spot.link, spot.channel, factor)

    return Mechanics(
        graph=p.graph,
        A=plus.A,
        plus=np.asarray(plus.b, float),
        minus=np.asarray(minus.b, float),
        c=np.asarray(plus.c, float),
        inputs=np.asarray(inputs, float),
        rows={},
        place_of=place_of,
        k_v=float(getattr(config.law.position, "velocity_gain", 0.0)),
        shaped=config.law.shaper.bandwidth is not None,
    )
