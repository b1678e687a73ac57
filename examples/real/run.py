"""Diagnosis of recordings of real machines, with a table of results.

    python examples/real/run.py [--out FOLDER] [--limit SECONDS] [CASE ...]
    python examples/real/run.py --table

Each case of cases.yaml (all where none is named) is imported and diagnosed in a process of its own. `found/CASE.json`
then holds verdict, effects and held-out errors, docs/images/real/CASE_missing.png and CASE_heldout.png its figures,
FOLDER (build/real) the other files. The environment variable REAL_DATA names the folder of the recordings, by default
../shared/data. --table rewrites the table of docs/proof.md from the files in `found`.
"""

import argparse
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from real_cases import FOLDER, ROOT, bundle, cases, imports, missing

from rtctl.config.arithmetic import equal_digits

FOUND = FOLDER / "found"
IMAGES = ROOT / "docs" / "images" / "real"
DIGITS = 3
PAGE = ROOT / "docs" / "proof.md"
NUMBER = re.compile(r"The machine acts as if (.*?) instead of")  # a description value far outside its tolerance
VERDICTS = ("named", "ambiguous", "unnamed", "nothing")
BEGIN, END = "<!-- found: begin -->", "<!-- found: end -->"


def run(name: str, case: dict[str, Any], out: Path) -> None:
    """Import and diagnose one case in this process, and write its result."""
    import rtctl
    from rtctl.diagnose.answer import figures

    out.mkdir(parents=True, exist_ok=True)
    for words in imports(case, out):
        if not (Path(words[words.index("-o") + 1])).exists():
            command = [sys.executable, "-m", "rtctl", *words]
            subprocess.run(command, check=True, cwd=FOLDER, stdout=subprocess.DEVNULL)
    os.chdir(FOLDER)
    made = rtctl.diagnose(
        *(bundle(case, one, out) for one in case["recordings"]), together=len(case["recordings"]) > 1, progress=False,
        **keywords(case),
    )  # fmt: skip
    made.save(out / "diagnosis")
    FOUND.mkdir(exist_ok=True)
    IMAGES.mkdir(exist_ok=True)
    (FOUND / f"{name}.json").write_text(json.dumps(short(made.as_json()), indent=1) + "\n")
    for kind in ("missing_force", "heldout"):
        figure = getattr(figures, kind)(made.found)
        figure.savefig(IMAGES / f"{name}_{kind.partition('_')[0]}.png", dpi=100, facecolor="white")


def keywords(case: dict[str, Any]) -> dict[str, Any]:
    """Options of `rtctl diagnose` as keyword arguments of rtctl.diagnose()."""
    options = case.get("options", [])
    return {word[2:]: value for word, value in zip(options[::2], options[1::2], strict=True)}


def short(told: dict[str, Any]) -> dict[str, Any]:
    """Part of diagnosis.json for `found`, with three digits: further digits depend on the processor."""
    fit, located = told["fit"], told["located"]
    return {
        "verdict": told["verdict"],
        "headline": told["headline"],
        "why": told["why"],
        "effects": [
            {
                "name": e["name"], "node": e["node"], "confidence": e["confidence"],
                "sizes": {
                    k: [rounded(x) for x in (v["value"], *v["ci90"])] + [v["unit"]] for k, v in e["parameters"].items()
                },
            }
            for e in told["effects"]
        ],
        "located": {k: located[k] for k in ("node", "axis")} if located else None,
        "heldout": [rounded(fit[f"heldout_nrmse_{k}"]) for k in ("before", "after")],
        "seconds": rounded(told["seconds"]),
    }  # fmt: skip


def rounded(value: float | None) -> float | None:
    """Value rounded to three digits."""
    return None if value is None else float(f"{value:.{DIGITS}g}")


def table() -> str:
    """Markdown table with a row for each finished case, by verdict, then in the order of cases.yaml."""
    lines = ["| case | expected (owner, literature) | found | held-out before, after |", "|---|---|---|---|"]
    there = [(name, case, FOUND / f"{name}.json") for name, case in cases().items()]
    finished = [(name, case, json.loads(file.read_text())) for name, case, file in there if file.exists()]
    return "\n".join(
        lines + [row(*each) for each in sorted(finished, key=lambda each: VERDICTS.index(each[2]["verdict"]))]
    )


def page(text: str) -> str:
    """Text of docs/proof.md with the new table of results."""
    head, _, rest = text.partition(BEGIN)
    return f"{head}{BEGIN}\n\n{table()}\n\n{END}{rest.partition(END)[2]}"


def row(name: str, case: dict[str, Any], found: dict[str, Any]) -> str:
    """Row of the table; a name known to be wrong is bold."""
    wrong = case.get("wrong", [])
    names = []
    for e in found["effects"]:
        sizes = ", ".join(f"{v[0]:g} {v[3]}".strip() for v in list(e["sizes"].values())[:1])
        text = f"{e['name']} at {e['node']}{f', {sizes}' if sizes else ''}, {100 * e['confidence']:.0f} %"
        names.append(f"**{text}: wrong**" if e["name"] in wrong else text)
    at = found["located"]
    number = NUMBER.match(found["headline"])
    if number is not None:
        names.insert(0, f"as if {number[1]}")
    elif found["verdict"] == "unnamed" and at:
        names.insert(0, f"an unexplained force or error at {at['node']} that depends on {at['axis']}")
    verdict = f"`{found['verdict']}`{': ' if names else ''}{'; '.join(names)}"
    before, after = (f"{100 * x:.2g} %" for x in found["heldout"])
    return f"| {name} | {case['known']} | {verdict} | {before}, {after} |"


def main() -> None:
    """Run each case in a separate process, which can be ended at the time limit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="CASE")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "real")
    parser.add_argument("--limit", type=float, default=1800.0, help="s of one case")
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    equal_digits()
    listed = cases()
    if args.table:
        PAGE.write_text(page(PAGE.read_text()))
        return
    if unknown := set(args.cases) - set(listed):
        parser.error(f"no such case: {', '.join(sorted(unknown))}; there are {', '.join(listed)}")
    for name in args.cases or listed:
        if args.here:
            run(name, listed[name], args.out.resolve() / name)
        elif missing(listed[name]):
            print(f"{name}: {missing(listed[name])} is not here", flush=True)
        else:
            words = [sys.executable, __file__, "--here", "--out", str(args.out), name]
            try:
                done = subprocess.run(words, timeout=args.limit, check=False)
                print(f"{name}: {'done' if done.returncode == 0 else f'exit code {done.returncode}'}", flush=True)
            except subprocess.TimeoutExpired:
                print(f"{name}: no answer in {args.limit:g} s", flush=True)


if __name__ == "__main__":
    main()
