"""One machine compiled by rtctl and as hand-written C, both on virtual time in this process."""

import ctypes
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from rtctl import machines
from rtctl.cli.common import load_config, with_loop, with_reference
from rtctl.loop import fused, generate
from rtctl.loop.loop import Loop
from rtctl.loop.mailbox import Mailbox
from rtctl.plants.graph import plant as graph
from rtctl.plants.graph.plant import GRAPH_STATE

HERE = Path(__file__).parent
CONFIGS = HERE.parent / "configs"
REFERENCES = {"ivu": "steps", "ldu": "print_steps"}


def machine_of(kind: str) -> machines.Machine:
    """The shipped config with the shipped reference, fused."""
    config = load_config(str(CONFIGS / f"{kind}.yaml"), [])
    config = with_reference(config, str(CONFIGS / "references" / f"{REFERENCES[kind]}.yaml"))
    return machines.build(with_loop(config, "fused", None))


class Ours:
    """Generated loop, run as in the daemon's loop process, but on plain arrays instead of a shared segment."""

    def __init__(self, machine: machines.Machine):
        self.machine, self.made = machine, generate.generate(machine, "shm")
        length = max(int(machine.config.record.seconds * machine.rate), 1000)  # of the ring, as in the supervisor
        self.segment = fused.segment(self.made, length)
        self.rows = self.segment["rows"]
        self.reset()
        self.loop.warm()

    def reset(self) -> None:
        """Reset to rest; armed, with the reference from the first tick."""
        for name, array in self.segment.items():
            if name != "rows":
                array[...] = np.zeros((), array.dtype)
        generate.prepare(self.segment, self.machine)
        Mailbox(self.segment).post(_arm_and_play)
        self.loop = Loop(self.machine, self.made, self.segment, self.segment["outputs"], self.segment["inputs"])

    def run(self, ticks: int) -> None:
        """Run from rest."""
        self.loop.stretch(0, ticks)


def _arm_and_play(_: Any, command: Any) -> None:
    command["arm"] += 1
    command["play"] += 1


class Reference:
    """C program of the machine, with equal parameters, matrices and row."""

    def __init__(
        self, machine: machines.Machine, row: np.dtype, rows: int, folder: Path, flags: tuple[str, ...] = ("-O2",)
    ):
        self.machine = machine
        source = HERE / f"reference_{machine.kind}.c"
        library = folder / f"{source.stem}{''.join(flags)}.so"
        command = ["cc", "-std=gnu11", *flags, "-shared", "-fPIC", "-o", str(library), str(source), "-lm"]
        subprocess.run(command, check=True)
        self._library = ctypes.CDLL(str(library))
        self._library.run.argtypes = (ctypes.c_int64, ctypes.c_int64, ctypes.c_double, ctypes.c_int64)
        self._library.run.restype = ctypes.c_int64
        self.rows = np.zeros(rows, row)
        self._check_row(row)
        values = _values(machine)
        self._parameters = b"".join(
            np.array([values[name] for name in self._names(list_)], dtype).tobytes()
            for list_, dtype in (("reals", np.float64), ("wholes", np.int64))
        )
        self._matrices = _matrices(machine)
        self._tables = tuple(
            np.ascontiguousarray(a) for a in (machine.reference.t, machine.reference.r, machine.excitation.x)
        )
        self.reset()

    def _names(self, list_: str) -> list[str]:
        text = ctypes.string_at(ctypes.addressof(ctypes.c_char.in_dll(self._library, list_)))
        return text.decode().split()

    def _check_row(self, row: np.dtype) -> None:
        """Raise RuntimeError where the C struct differs from the columns of the trace; add new columns there, too."""
        text = (HERE / f"reference_{self.machine.kind}.c").read_text()
        body = text[text.index("struct row {") :].split("}")[0].replace("\n", " ")
        written = [name for part in body.split("{")[1].split(";") for name in part.replace(",", " ").split()[1:]]
        if written != list(row.names or ()):
            raise ValueError(
                f"reference_{self.machine.kind}.c: struct row has {written}, the trace {list(row.names or ())}"
            )

    def reset(self) -> None:
        """Reset to rest."""
        pointers = (*self._matrices, *self._tables, self.rows)
        self._library.prepare(
            self._parameters, *(ctypes.c_void_p(a.ctypes.data) for a in pointers), ctypes.c_int64(len(self.rows))
        )

    def run(self, ticks: int) -> None:
        """Run from rest. Raises RuntimeError where the plant would have updated its matrices: C does not."""
        machine = self.machine
        period = round(1e9 / machine.rate) * 1e-9
        ahead = int(machine.config.loop.write == "next_tick")
        if self._library.run(ticks, machine.substeps, period, ahead):
            raise RuntimeError("the reels' radii changed so much that the matrices differ from those handed to C")


def _values(machine: machines.Machine) -> dict[str, float]:
    """Numbers of the diagrams by their names in C: block_field, and plant_block_field."""
    out: dict[str, float] = {}
    for prefix, blocks in (("", machine.diagram.blocks), ("plant_", machine.plant_diagram.blocks)):
        for block in blocks:
            _collect(out, f"{prefix}{block.name}", block.params)
    _collect(out, "reference", machine.reference)
    _collect(out, "excitation", machine.excitation)
    return out


def _collect(out: dict[str, float], prefix: str, params: Any) -> None:
    for name in getattr(params, "_fields", ()):
        value = getattr(params, name)
        if isinstance(value, (int, float)):
            out[f"{prefix}_{name}"] = value


def _matrices(machine: machines.Machine) -> tuple[np.ndarray, np.ndarray]:
    """Matrices Phi and Gamma of one substep, from the equations of the plant."""
    plant = next(b for b in machine.plant_diagram.blocks if b.name == "plant")
    p, s = plant.params.graph, np.zeros(1, GRAPH_STATE)[0]
    graph.start(p, s)
    m = s["m"]
    return m["Phi_T"][: p.nx, : p.nx].copy(), m["Gamma_T"][: p.nu + p.nq, : p.nx].copy()
