"""Diagnosis of one bundle, or of several bundles of one machine, written into a folder."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.config.errors import UserError
from rtctl.trace.bundle import load_case


class Diagnosed(NamedTuple):
    """A diagnosis on disk."""

    diagnosis: Any  # GraphDiagnosis
    data: dict[str, Any]  # as in diagnosis.json
    faults: tuple[str, ...]  # one sentence for each file that could not be made


def of_one_machine(bundles: Sequence[Path], together: bool) -> None:
    """Raise UserError unless the bundles are recordings of one machine.

    Bundles are of one machine where each case names the same `group`, or the user says so (`together`).
    """
    groups = {bundle: str(load_case(bundle).get("group") or "") for bundle in bundles}
    if together:
        return
    if len(set(groups.values()) | {""}) != 2:
        told = ", ".join(f"{bundle}: {group or 'none'}" for bundle, group in groups.items())
        raise UserError(
            f"the recordings do not name the same group in case.json ({told}); give --together if they are of one "
            "machine, else diagnose each alone, or the folder around them"
        )
    if "" in groups.values():
        bundle = next(bundle for bundle, group in groups.items() if not group)
        raise UserError(f"{bundle}/case.json: group is missing; write the group of the others, or give --together")


def diagnose_into(
    bundle: Path,
    other: Path | None,
    out: Path,
    report: bool = True,
    base: Path | None = None,
    progress: Callable[[str], None] = lambda _: None,
    more: Sequence[Path] = (),
) -> Diagnosed:
    """Diagnosis of the bundle, written into `out`; `other` is a second recording of the same machine.

    `more` are recordings of the same machine that are fitted together with the first. Where `base` is given, no link
    may lead out of `base`. Raises UserError for a bundle that cannot be read and for a disk that does not take the
    results, NoAnswer for a bundle that supports no verdict.
    """
    from rtctl.diagnose.answer import answer, files
    from rtctl.diagnose.answer.results import finite
    from rtctl.diagnose.answer.second import predicted

    found = answer.diagnose(bundle, *more, progress=progress)
    if other is not None:
        progress("predicting the second recording")
        found = predicted(found, other)
    progress("writing the results")
    faults = files.write(found, out, report, base)
    return Diagnosed(found, finite(found.as_json()), tuple(faults))
