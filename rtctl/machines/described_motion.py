"""Mechanics of a described machine for a feedforward along its reference."""

from typing import Any

import numpy as np

from rtctl.machines.described_parts import parts_of, shares_of
from rtctl.machines.described_plant import graph_of
from rtctl.machines.reference_motion import Mechanics
from rtctl.plants.graph.elements import place_of
from rtctl.plants.graph.joints import sprung
from rtctl.plants.graph.linearised import sensor_row
from rtctl.plants.graph.mechanics import code_of
from rtctl.plants.graph.plant import state_space


def mechanics(config: Any, dt: float) -> Mechanics:
    """Linear model of a described machine, with a spring in each joint that its effects make elastic.

    Raises ValueError where the loop closes on a speed, or where the mechanics are in a file.
    """
    parts = parts_of(config)
    if parts.is_speed:
        raise ValueError(
            f"law.compensation.feedforward: the loop closes on a speed, that of {parts.feedback}; a feedforward "
            "along the reference takes a position"
        )
    if code_of(config.machine) is not None:
        raise ValueError(
            "law.compensation.feedforward: machine.mechanics is a file; a feedforward is made of joints and bodies"
        )
    machine, _ = sprung(config.machine, config.plant.physics)
    layout, values, graph = graph_of(machine, dt)
    A, B = state_space(graph)
    command = B @ shares_of(config)[: B.shape[1]]
    rows = {}
    for name in machine.bodies:
        if not machine.is_frame(name):
            rows[name] = np.zeros(graph.nq)
            rows[name][layout.coordinate(name)] = layout.ratio(name, values)
    return Mechanics(
        graph=graph,
        A=A,
        plus=command,
        minus=command,
        c=sensor_row(machine, graph, parts.feedback),
        inputs=shares_of(config),
        rows=rows,
        place_of=lambda entry: place_of(layout, values, entry),
        k_v=float(getattr(config.law.position, "velocity_gain", 0.0)),
        shaped=config.law.shaper.bandwidth is not None,
    )
