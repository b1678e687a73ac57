"""Block diagrams are consistent: every column is written, every block and module is declared and used."""

import re
from typing import Any

import fused
import pytest
from pydantic import ValidationError

from rtctl import machines
from rtctl.config.errors import UserError
from rtctl.loop import generate
from rtctl.machines.base import COMMON_COLUMNS

LOOP_WRITES = {"tick", "t", "period", "lateness"}  # columns written by the runner
MACHINES = ["ivu", "ldu", "axis"]


@pytest.fixture(params=MACHINES)
def machine(request: Any) -> machines.Machine:
    return machines.build(fused.config(request.param))


def lines(*stages: Any) -> str:
    """Text of the lines of all stages."""
    return "\n".join(line for stage in stages for _, body in stage for line in body)


def source(machine: machines.Machine) -> str:
    """Lines of the loop, and the functions of the machine module that the lines call."""
    import inspect

    return lines(machine.diagram.stages) + inspect.getsource(machines.MODULES[machine.kind])


def test_every_column_is_written(machine):
    text = lines(machine.diagram.stages)
    written = set(re.findall(r"\by\.(\w+) =(?!=)", text)) | LOOP_WRITES
    columns = [c.name for c in machine.diagram.columns]
    assert set(columns) == written
    assert len(columns) == len(set(columns))
    assert tuple(machine.diagram.columns[: len(COMMON_COLUMNS)]) == COMMON_COLUMNS


def test_every_column_has_a_help_text(machine):
    for column in (*machine.diagram.columns, *machine.truth):
        assert column.help and column.help.isascii()


def test_every_truth_column_is_written(machine):
    written = {
        int(i)
        for i in re.findall(
            r"rx\.truth\[(\d+)\] =", "\n".join(b for _, body in machine.plant_diagram.sample for b in body)
        )
    }
    assert written == set(range(len(machine.truth)))


@pytest.mark.parametrize("part", ["loop", "plant"])
def test_every_block_is_used_and_every_used_block_exists(machine, part):
    diagram: Any = machine.diagram if part == "loop" else machine.plant_diagram
    if part == "loop":
        text = source(machine)
    else:
        text = "\n".join(diagram.start) + lines(diagram.advance, diagram.sample)
    names = {b.name for b in diagram.blocks}
    assert len(names) == len(diagram.blocks)
    for block in diagram.blocks:
        assert block.params is None or re.search(rf"\bp\.{block.name}\b", text), f"p.{block.name} is never read"
        assert block.state is None or re.search(rf"\bs\.{block.name}\b", text), f"s.{block.name} is never used"
    stages = lines(diagram.stages) if part == "loop" else text
    held = (
        {b.name for b in diagram.blocks if b.params is not None},
        {b.name for b in diagram.blocks if b.state is not None},
    )
    assert set(re.findall(r"\bp\.(\w+)", stages)) <= held[0]
    assert set(re.findall(r"\bs\.(\w+)", stages)) <= held[1]


def test_every_module_is_used_and_every_used_module_exists(machine):
    for diagram, text in (
        (machine.diagram, lines(machine.diagram.stages)),
        (
            machine.plant_diagram,
            "\n".join(machine.plant_diagram.start) + lines(machine.plant_diagram.advance, machine.plant_diagram.sample),
        ),
    ):
        called = set(re.findall(r"\b([a-z_]\w*)\.\w+\(", text)) - {"machine", "np"}
        assert called <= {module.rpartition(".")[2] for module in diagram.uses}


def test_generated_tick_is_valid_python(machine):
    for link in ("zmq", "shm"):
        compile(generate.source(machine, link), machine.kind, "exec")


@pytest.mark.parametrize(
    ("name", "node", "near"),
    [("ivu", "moter1", "motor1"), ("ldu", "carrage", "carriage"), ("axis", "cariage", "carriage")],
)
def test_unknown_node_error_suggests_the_nearest_name(name, node, near):
    with pytest.raises((UserError, ValidationError), match=f"did you mean '{near}'"):
        fused.config(name, plant__physics=[{"term": "friction.viscous", "node": node, "B": 0.1}])


def test_unknown_node_error_lists_the_nodes_of_the_plant():
    with pytest.raises((UserError, ValidationError), match="motor1, motor2, reel1"):
        fused.config("ivu", plant__physics=[{"term": "friction.viscous", "node": "x", "B": 0.1}])


@pytest.mark.parametrize("name", MACHINES)
def test_parameter_change_does_not_change_the_tick(name):
    """A change of a gain or of a fitted value never recompiles."""
    one = machines.build(fused.config(name))
    two = machines.build(fused.config(name, law__position__gain=1.0, safety__following_error=0.01))
    assert generate.source(one, "shm") == generate.source(two, "shm")
