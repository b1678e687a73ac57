"""Choice of the engine for a bundle: machines known by name (format 1), or described by their parts (format 2)."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.trace.bundle import load_case

DESCRIBED_FORMAT = 2


class Diagnosed(NamedTuple):
    """A diagnosis on disk."""

    diagnosis: Any  # Diagnosis, or GraphDiagnosis of a described machine
    data: dict[str, Any]  # as in diagnosis.json
    faults: tuple[str, ...]  # a sentence on each file that could not be made
    described: bool


def is_described(case: dict[str, Any]) -> bool:
    """Whether the case of a bundle describes its machine by bodies, joints, drives and sensors."""
    return case.get("format") == DESCRIBED_FORMAT or isinstance(case.get("machine"), dict)


def load(bundle: Path) -> Any:
    """The record of a bundle, checked. Raises UserError and NoAnswer as `diagnose_into`."""
    if bundle.is_dir() and is_described(load_case(bundle)):
        from rtctl.diagnose.graph.record import load_record as load_graph

        return load_graph(bundle)
    from rtctl.diagnose.record import load_record

    return load_record(bundle)


def diagnose_into(
    bundle: Path,
    other: Path | None,
    out: Path,
    report: bool = True,
    base: Path | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Diagnosed:
    """Diagnose the bundle and write the results into `out`; `other` is a second recording of the same machine.

    Where `base` is given, no link may lead out of it. Raises UserError for a bundle that cannot be read and for a disk
    that does not take the results, NoAnswer for a bundle that supports no verdict.
    """
    from rtctl.diagnose.results import finite

    if bundle.is_dir() and is_described(load_case(bundle)):
        from rtctl.diagnose.graph import answer, files

        found = answer.diagnose(bundle, progress)
        if other is not None:
            from rtctl.diagnose.graph.second import predicted

            progress("predicting the second recording")
            found = predicted(found, other)
        progress("writing the results")
        faults = files.write(found, out, report, base)
        return Diagnosed(found, finite(found.as_json()), tuple(faults), True)
    from rtctl.diagnose.chain import diagnose
    from rtctl.diagnose.diagnosis import as_json
    from rtctl.diagnose.folder import own_config, write

    d = diagnose(bundle, other, progress)
    progress("writing the results")
    return Diagnosed(d, finite(as_json(d)), tuple(write(d, out, own_config(bundle), report, base)), False)
