"""Modes of a described machine in words: frequency, damping, and which bodies move."""

from rtctl.machines.described_plant import graph_of
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.linearised import Mode, modes


def modes_of(machine: Description) -> list[Mode]:
    """Modes by rising frequency, with the bodies that move; a mode of a drive has none."""
    layout, _, p = graph_of(machine, 1e-3)
    moving = [name for name in machine.bodies if not machine.is_frame(name)]
    return modes(machine, p, moving, [layout.coordinate(name) for name in moving])


def sentences(machine: Description) -> list[str]:
    """A line for each mode."""
    found = []
    for mode in modes_of(machine):
        who = " and ".join(mode.bodies) or "the drive"
        if mode.hertz:
            grows = "; it grows by itself" if mode.damping < 0 else ""
            found.append(f"{mode.hertz:.4g} Hz, damping {mode.damping:.3g}: {who}{grows}")
        elif mode.rate > 0:
            found.append(f"falls away, twice as far every {0.693 / mode.rate:.3g} s: {who}")
        else:
            found.append(f"time constant {-1.0 / mode.rate:.3g} s: {who}")
    return found or ["none: it moves freely"]
