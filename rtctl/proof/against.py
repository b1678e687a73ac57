"""Comparison of the answers of two programs to the same concealed cases, case by case."""

from pathlib import Path
from typing import Any, NamedTuple

from rtctl.config.errors import UserError
from rtctl.proof import seal
from rtctl.proof.prove import diagnoses_of
from rtctl.proof.report import table
from rtctl.proof.score import row_of, score

Json = dict[str, Any]
WORDS = {
    (False, True): "better",
    (True, False): "worse",
    (True, True): "right as before",
    (False, False): "wrong as before",
}


class Pair(NamedTuple):
    """Case with different answers of the two programs."""

    case: str
    truth: str
    before: str  # verdict and names
    now: str
    change: str  # one of WORDS


def pairs(folder: Path, before: Path) -> list[Pair]:
    """Cases that both folders answer, with different answers.

    Raises UserError where the folders hold different cases.
    """
    answers, others = seal.open_seal(folder), seal.open_seal(before)
    if answers != others:
        raise UserError(f"{before} holds other cases than {folder}: '{others.get('mix')}', not '{answers.get('mix')}'")
    old, new = diagnoses_of(before), diagnoses_of(folder)
    both = {case: a for case, a in answers["cases"].items() if old.get(case) and new.get(case)}
    wrong = [{f["case"] for f in score(both, found)["failures"]} for found in (old, new)]
    out = []
    for case, a in sorted(both.items()):
        told = said(old[case]), said(new[case])
        if told[0] != told[1]:
            out.append(Pair(case, row_of(a), *told, WORDS[case not in wrong[0], case not in wrong[1]]))
    return out


def said(diagnosis: Json) -> str:
    """Text of a diagnosis: verdict, and names with their nodes."""
    names = [f"{e['name']}:{e['node']}" for e in diagnosis.get("effects") or []]
    return " ".join([str(diagnosis["verdict"]), *names])


def words(found: list[Pair]) -> str:
    """Table of the cases that differ, and numbers of better and worse answers."""
    if not found:
        return "both programs answer all cases alike"
    counts = ", ".join(f"{n} {word}" for word in WORDS.values() if (n := sum(p.change == word for p in found)))
    return f"{table(['case', 'true', 'before', 'now', ''], [list(p) for p in found])}\n\n{counts}"
