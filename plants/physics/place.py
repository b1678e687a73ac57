"""Place of a node in the record of its plant: indices from the tables in plants/."""

from typing import NamedTuple

from rtctl.plants import axis, ivu, ldu

PLANTS = {plant.NAME: plant for plant in (ivu, ldu, axis)}


class Place(NamedTuple):
    node: int  # index into positions and forces
    link: int  # index of the spring that the node names
    channel: int  # of the drive or the sensor
    factor: str  # plant parameter that takes the node's rotation to its own unit; empty for 1


def place(kind: str, node: str) -> Place:
    """Place of a node by its name; a missing link or channel is 0, since no term of the node uses it."""
    plant = PLANTS[kind]
    index, factor = plant.NODES.get(node, plant.RUBS.get(node, 0)), ""
    channel = plant.DRIVES.get(node, plant.SENSORS.get(node, 0))
    index, factor, channel = plant.SPOTS.get(node, (index, factor, channel))
    return Place(index, plant.LINKS.get(node, 0), channel, factor)
