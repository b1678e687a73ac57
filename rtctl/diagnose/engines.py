"""Choice of the engine for a bundle.

likelihood  a posterior over all hypotheses, for any described machine: those of format 2, and the three of format 1
rules       the older one, for the three machines of format 1
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.config.errors import UserError
from rtctl.trace.bundle import load_case

DESCRIBED_FORMAT = 2
RULES, LIKELIHOOD = "rules", "likelihood"  # engines; the first judges the machines of format 1 alone
ENGINES = (RULES, LIKELIHOOD)


class Diagnosed(NamedTuple):
    """A diagnosis on disk."""

    diagnosis: Any  # Diagnosis, or GraphDiagnosis of a described machine
    data: dict[str, Any]  # as in diagnosis.json
    faults: tuple[str, ...]  # a sentence on each file that could not be made
    described: bool


def is_described(case: dict[str, Any]) -> bool:
    """Whether the case of a bundle describes its machine by bodies, joints, drives and sensors."""
    return case.get("format") == DESCRIBED_FORMAT or isinstance(case.get("machine"), dict)


def of_described(bundle: Path) -> bool:
    """Whether a bundle is of a described machine; False where its case cannot be read, which the engine then tells."""
    try:
        return is_described(load_case(bundle))
    except UserError:
        return False


def load(bundle: Path) -> Any:
    """The record of a bundle, checked. Raises UserError and NoAnswer as `diagnose_into`."""
    if of_described(bundle):
        from rtctl.diagnose.graph.record import load_record as load_graph

        return load_graph(bundle)
    from rtctl.diagnose.record import load_record

    return load_record(bundle)


def of_one_machine(bundles: Sequence[Path], together: bool, engine: str = RULES) -> None:
    """Raise UserError unless the bundles are recordings of one machine that `engine` takes together.

    They are where each case names the same `group`, or the user says so (`together`).
    """
    groups = {}
    for bundle in bundles:
        case = load_case(bundle)
        if engine != LIKELIHOOD and not is_described(case):
            raise UserError(
                f"{bundle}: recordings are taken together by --engine likelihood; diagnose this one alone, or a folder "
                "of bundles each by itself"
            )
        groups[bundle] = str(case.get("group") or "")
    if not together and len(set(groups.values()) | {""}) != 2:
        told = ", ".join(f"{bundle}: {group or 'none'}" for bundle, group in groups.items())
        raise UserError(
            f"several recordings are one machine where their case.json names one group ({told}); give --together if "
            "they are of one machine, else diagnose each by itself or the folder that holds them"
        )
    if not together and "" in groups.values():
        bundle = next(bundle for bundle, group in groups.items() if not group)
        raise UserError(f"{bundle}/case.json: group is missing, and the others have one; give --together if it belongs")


def diagnose_into(
    bundle: Path,
    other: Path | None,
    out: Path,
    report: bool = True,
    base: Path | None = None,
    progress: Callable[[str], None] = lambda _: None,
    engine: str = RULES,
    more: Sequence[Path] = (),
) -> Diagnosed:
    """Diagnose the bundle and write the results into `out`; `other` is a second recording of the same machine.

    `more` are recordings of the same described machine that are fitted together with the first. Where `base` is given,
    no link may lead out of it. `engine` is that of a machine of format 1; a described machine has but one. Raises
    UserError for a bundle that cannot be read and for a disk that does not take the results, NoAnswer for a bundle that
    supports no verdict.
    """
    from rtctl.diagnose.results import finite

    if engine == LIKELIHOOD or of_described(bundle):
        from rtctl.diagnose.graph import answer, files

        found = answer.diagnose(bundle, *more, progress=progress)
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


class Judge(NamedTuple):
    """What an engine does with the recordings that a repair makes."""

    repairs: dict[str, Any]  # arguments of `repair`
    write: Callable[[Any, Path, bool], list[str]]  # repair, folder, whether with a report -> faults
    changes: Callable[[Any], list[tuple[str, str, str]]]  # diagnosis -> (key, was, is)
    as_json: Callable[[Any], dict[str, Any]]
    described: bool


def judge(engine: str, described: bool) -> Judge:
    """The judge of an engine; that of a described machine is always the likelihood."""
    if described or engine == LIKELIHOOD:
        return _by_likelihood()
    from rtctl.diagnose import folder, repair
    from rtctl.diagnose.diagnosis import as_json

    def write(made: Any, out: Path, report: bool) -> list[str]:
        return folder.write(made.last, out, folder.own_config(made.bundle), report)

    return Judge({}, write, repair.changes, as_json, False)


def _by_likelihood() -> Judge:
    from rtctl.diagnose.graph import answer, files

    def diagnose(bundle: Path, other: Path | None, progress: Callable[[str], None]) -> Any:
        return answer.diagnose(*([other] if other is not None else []), bundle, progress=progress)

    def write(made: Any, out: Path, report: bool) -> list[str]:
        return files.write(made.last, out, report)

    repairs = {"diagnose": diagnose, "both": True}
    return Judge(repairs, write, files.changes, lambda d: dict(d.as_json()), True)
