"""Records under the machine and the physics of a config, which replace the nominal model."""

from pathlib import Path

from rtctl.case.format2 import read_case
from rtctl.case.quantities import of_case
from rtctl.config.errors import UserError
from rtctl.config.yaml_file import find
from rtctl.diagnose.likelihood.joint import check_same
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.plants.graph.file import read_machine


def believing(record: GraphRecord, path: Path | str) -> GraphRecord:
    """Record of a described machine under machine and physics of a config or a bare description.

    The rest of its case is unchanged. Raises UserError where the file cannot be read or is of a machine with other
    elements.
    """
    file = find(str(path))
    told = read_machine(file)
    machine = told.machine.model_dump(mode="json", exclude_unset=True)
    given = {"format": 2, "machine": machine, "physics": list(told.physics), "problem": record.case.problem}
    read = read_case({**given, "delay_samples": record.case.delay_samples}, file.parent)
    new = record.case._replace(machine=read.machine, layout=read.layout, values=read.values, physics=read.physics)
    other = record._replace(case=new._replace(file=file))
    check_same(record, other)
    return other._replace(case=new)


def check_believed(record: GraphRecord) -> None:
    """Raise UserError where the case lacks a parameter that a simulation needs and a fit would estimate."""
    source = record.source
    if source is None:
        return
    estimated = source.case.estimated
    for name, words in of_case(source.case).needed().items():
        if name in estimated:
            raise UserError(
                f"{source.case.file}: parameters.{name} is missing ({words}); add it: without it there is no nominal "
                "model to simulate, only a fitted one"
            )
