"""Improvement of concealed machines: diagnosis from a recording, improvement on the found model, run on the truth.

    python benchmarks/improve.py [--machines 60] [--seed 71] [--jobs 2] [--out FOLDER] [--json]

The machines are the reel unit, the linear drive, the belt axis and the arm in turn, each with one effect drawn by a
seed (name, node, size). A recording of the usual reference is diagnosed without knowledge of the effect. The improved
law and the previous law then run on the concealed machine with an equal reference; errors are true errors of the
emulator. Margins are those of the fitted model. Results of each machine are kept in --out: an interrupted run
continues.

Prints {"machines", "median_rms_reduction", "improved_share", "worse_share", "least_gain_margin_db",
"least_phase_margin_deg"}. A machine without improvement counts as a reduction of 0. Margins are the least over machines
with a changed config.
"""

import argparse
import json
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

KINDS = ("ivu", "ldu", "belt", "arm")
LONG = 16.0  # s, length of a recording
TRIES = 100
WORSE = 0.05  # relative increase of the error that counts as worse
BETTER = 0.02  # relative reduction of the error that counts as improved


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=60)
    parser.add_argument("--seed", type=int, default=71)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, help="folder that keeps recordings, diagnoses and results")
    parser.add_argument(
        "--known",
        action="store_true",
        help="only the remedies: the model has the true effect, no diagnosis",
    )
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="rtb-", dir="/tmp") as name:
        out = given.out or Path(name)
        out.mkdir(parents=True, exist_ok=True)
        tasks = [(given.seed, k, str(out), given.known) for k in range(given.machines)]
        with ProcessPoolExecutor(given.jobs) as pool:
            results = []
            for found in pool.map(one, tasks):
                results.append(found)
                if not given.json:
                    print(told(found), flush=True)
    print(json.dumps(summary(results)))


def summary(results: list[dict[str, Any]]) -> dict[str, Any]:
    """Summary that the benchmark prints."""
    cut = np.array([found["reduction"] for found in results])
    margins = [found["margins"] for found in results if found["margins"] is not None]
    return {
        "machines": len(results),
        "median_rms_reduction": float(np.median(cut)),
        "improved_share": float(np.mean(cut > BETTER)),
        "worse_share": float(np.mean(cut < -WORSE)),
        "least_gain_margin_db": min((gm for gm, _ in margins), default=None),
        "least_phase_margin_deg": min((pm for _, pm in margins), default=None),
    }


def told(found: dict[str, Any]) -> str:
    """Result of one machine in a line."""
    effect = found["effect"]
    what = f"{found['machine']:5} {effect['term']} at {effect['node']}"
    named = ", ".join(found["named"]) or found["verdict"]
    return f"{what:50} {named:50} {100 * found['reduction']:+6.1f} %  {found['seconds']:.0f} s  {found['why']}"


def one(task: tuple[int, int, str, bool]) -> dict[str, Any]:
    """Result of one machine: conceal, record, diagnose, improve, and run again; read from its file where it exists."""
    seed, k, folder, known = task
    kind = KINDS[k % len(KINDS)]
    place = Path(folder) / f"{kind}-{k:03d}"
    file = place / "result.json"
    if file.is_file():
        return json.loads(file.read_text())
    began = time.monotonic()
    place.mkdir(parents=True, exist_ok=True)
    found: dict[str, Any] = {
        "machine": kind, "effect": {"term": "", "node": ""}, "verdict": "", "named": [], "reduction": 0.0,
        "margins": None, "why": "",
    }  # fmt: skip
    try:
        base, truth, found["effect"] = concealed(kind, seed + k)
        found |= improved(base, truth, place, known)
    except Exception as error:  # counts as not improved, with the reason
        found["why"] = f"{type(error).__name__}: {str(error)[:200]}"
    found["seconds"] = time.monotonic() - began
    file.write_text(json.dumps(found, default=float) + "\n")
    return found


def concealed(kind: str, seed: int) -> tuple[Any, Any, dict[str, Any]]:
    """Nominal config, config of the true machine, and its concealed effect."""
    from rtctl import machines
    from rtctl.cli.common import load_config
    from rtctl.config.errors import UserError
    from rtctl.config.load import set_path
    from rtctl.diagnose import conceal
    from rtctl.improve import played
    from rtctl.machines.base import DESCRIBED
    from rtctl.plants import physics
    from rtctl.plants.graph.elements import elements
    from rtctl.plants.graph.layout import layout

    path = kind if kind in machines.CONFIGS else f"machines/{kind}"
    base = played.with_reference(load_config(path, []))
    if base.kind != DESCRIBED:
        truth, entry = conceal.conceal(base, seed)
        return base, truth, entry
    rng = np.random.default_rng([seed, *base.name.encode()])
    there = elements(layout(base.machine))
    names = [name for name, term in sorted(physics.TERMS.items()) if term.in_format(2) and physics.nodes(term, there)]
    for _ in range(TRIES):
        name = names[rng.integers(len(names))]
        nodes = physics.nodes(physics.TERMS[name], there)
        entry = conceal.sized(name, nodes[rng.integers(len(nodes))], base, rng)
        try:
            truth = set_path(base, "plant.physics.0", entry)
            machines.build(truth)
        except (UserError, ValueError):
            continue
        return base, truth, entry
    raise ValueError(f"{kind}: nothing can be hidden in it")


def improved(base: Any, truth: Any, place: Path, known: bool) -> dict[str, Any]:
    """Improvement by the model of a diagnosis, evaluated on the true machine."""
    from rtctl.config.errors import NoAnswer, UserError
    from rtctl.improve import found as model
    from rtctl.improve import played
    from rtctl.improve.improve import improve

    if known:
        start = model.of_config(truth, "told")
        verdict = "told"
    else:
        if not (place / model.FOLDER / model.RESULT).is_file():
            from rtctl.diagnose.answer import answer, files

            record(base, truth, place)
            files.write(answer.diagnose(place), place / model.FOLDER, report=False)
        start = model.load(place, None, None)
        verdict = json.loads((place / model.FOLDER / model.RESULT).read_text())["verdict"]
    told_of = {"verdict": verdict, "named": [effect.words for effect in start.effects]}
    try:
        r = improve(start, written_too=False)
    except (NoAnswer, UserError) as error:
        return {**told_of, "why": str(error)}
    judge, seconds = played.judge_of(base), played.seconds_of(base)
    before = played.play(r.without, truth, seconds, judge)
    if before.figures.tripped:
        return {**told_of, "why": f"trips as it is: {before.figures.tripped}"}
    after = played.play(r.trial, truth, seconds, judge, before.ref)
    m = r.margins_after
    return {
        **told_of,
        "reduction": 1.0 - after.figures.rms / before.figures.rms,
        "before": before.figures._asdict(),
        "after": after.figures._asdict(),
        "on_the_model": r.reduction,
        "margins": (min(m.GM, 60.0), m.PM) if m is not None and any(one.kept for one in r.tried) else None,
        "kept": [one.remedy.kind for one in r.tried if one.kept],
        "left_out": {one.remedy.kind: one.reason for one in r.tried if not one.kept},
    }


def record(base: Any, truth: Any, place: Path) -> None:
    """Write a recording of the concealed machine under the nominal law, as the daemon would."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    from rtctl import machines
    from rtctl.daemon.case import describe
    from rtctl.loop import fused, generate

    machine, real = machines.build(base), machines.build(truth)
    machine = machine._replace(plant_diagram=real.plant_diagram, truth=real.truth)
    made = generate.generate(machine, "shm")
    rows = fused.play(machine, made, round(LONG * machine.rate)).rows
    names = [name for name in rows.dtype.names if not name.startswith("truth_")]
    pq.write_table(pa.table({name: rows[name].copy() for name in names}), place / "recording.parquet")
    (place / "case.json").write_text(json.dumps(describe(machine, made), default=float))


if __name__ == "__main__":
    main()
