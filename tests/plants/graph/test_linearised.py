"""Linear model of a described machine: gravity stiffness, sensor rows, term locations."""

import numpy as np
import pytest

from rtctl.plants.graph.description import Description
from rtctl.plants.graph.elements import check_node, elements, place_of
from rtctl.plants.graph.layout import NOWHERE, layout
from rtctl.plants.graph.linearised import linearised, sensor_row
from rtctl.plants.graph.params import build
from rtctl.plants.graph.played import played
from rtctl.plants.physics import TERMS, nodes

PENDULUM = {
    "bodies": {
        "motor": {"inertia": 1e-5},
        "rod": {"inertia": 0.01, "dry": 1e-3, "gravity": {"mass": 0.3, "arm": 0.2, "angle": 0.0}},
    },
    "joints": {"gear": {"from": "motor", "to": "rod", "ratio": 0.1}},
    "drives": {"bridge": {"body": "motor", "column": "u", "gain": 0.01, "limit": 10.0}},
    "sensors": {"encoder": {"body": "rod", "column": "counts", "counts_per_unit": 1000.0},
                "tacho": {"body": "rod", "measures": "speed", "column": "speed_read"}},
}  # fmt: skip


def machine(**gravity):
    data = {**PENDULUM, "bodies": {**PENDULUM["bodies"]}}
    data["bodies"]["rod"] = {**data["bodies"]["rod"], "gravity": {**data["bodies"]["rod"]["gravity"], **gravity}}
    made = Description.model_validate(data)
    values = dict(made.paths())
    return made, layout(made), values, build(layout(made), values, 1e-4)


@pytest.mark.parametrize(("angle", "sign"), [(0.0, -1), (np.pi, 1), (np.pi / 2, 0)])
def test_gravity_is_a_linear_stiffness_at_the_start_angle(angle, sign):
    _, _, _, p = machine(angle=angle)
    A, B = linearised(p)
    inertia = 1e-5 + 0.01 * 0.01  # reflected to the motor
    assert A[1, 0] == pytest.approx(sign * 0.01 * 0.3 * 9.80665 * 0.2 / inertia, abs=1e-9)
    assert B[1, 0] == pytest.approx(0.01 / inertia)


def test_sensor_row_contains_the_gear_ratio():
    made, _, _, p = machine()
    assert sensor_row(made, p, "encoder").tolist() == [0.1, 0.0]
    assert sensor_row(made, p, "tacho").tolist() == [0.0, 0.1]


def test_term_locations_follow_from_the_layout():
    made, lay, values, _ = machine()
    coulomb = TERMS["friction.coulomb"].settings.model_validate({"term": "friction.coulomb", "node": "rod", "F_C": 1.0})
    assert place_of(lay, values, coulomb) == (0, NOWHERE, NOWHERE, 0.1, NOWHERE)
    there = elements(lay)
    assert nodes(TERMS["friction.stribeck"], there) == ("motor", "rod")
    assert nodes(TERMS["transmission.hysteresis"], there) == ()  # the gear is rigid
    assert nodes(TERMS["structure.compliance"], there) == ("gear",)
    assert nodes(TERMS["drive.deadband"], there) == ("bridge",) and nodes(TERMS["timing.delay"], there) == ("loop",)
    with pytest.raises(
        ValueError, match=r"^physics.0.node: drive.deadband cannot stand at 'rod'; it can stand at bridge"
    ):
        check_node(made, "physics.0.node", "drive.deadband", "rod")


def test_constant_command_deflects_the_pendulum_to_its_equilibrium():
    _, _, _, p = machine()
    torque = 1.0 * 0.01 / 0.1  # at the rod, by 1 V
    y = played(p, np.full((6000, 1), 1.0), 5)
    settled = np.arcsin(torque / (0.3 * 9.80665 * 0.2))
    assert y[0].tolist() == [0.0, 0.0]
    assert y[-3000:, 0].mean() == pytest.approx(settled, rel=0.15)  # the pendulum oscillates about the equilibrium
