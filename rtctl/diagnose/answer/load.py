"""Records of described machines from bundles of either exchange format."""

from pathlib import Path

from rtctl.case.format1 import Case
from rtctl.case.load import read_case
from rtctl.diagnose.answer.believe import believing
from rtctl.diagnose.answer.format1_config import read_model
from rtctl.diagnose.model.format1 import graph_record
from rtctl.diagnose.model.recording import GraphRecord, record_of
from rtctl.diagnose.record import format1 as known
from rtctl.trace.bundle import PARQUET, Bundle, load_bundle


def load(folder: Path | str) -> GraphRecord:
    """Checked record of a bundle.

    Raises UserError that names file, column, row and the correct value, NoAnswer where the recording supports no
    verdict.
    """
    return of_bundle(load_bundle(folder))


def of_bundle(bundle: Bundle, model: Path | str | None = None) -> GraphRecord:
    """Record of a bundle in memory; its nominal model is that of a config `model` where one is given.

    Raises the errors of `load`, and UserError where the model is of another machine.
    """
    case = read_case(bundle.case, bundle.folder)
    if isinstance(case, Case):
        source = known.record_of(bundle, case)
        return graph_record(source, None if model is None else read_model(model, source))
    record = record_of(bundle.columns, case, bundle.folder / PARQUET)
    return record if model is None else believing(record, model)
