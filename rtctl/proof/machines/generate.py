"""Generation of concealed cases of described machines: draw, simulation with and without effects, bundle, answer.

A case depends only on (seed, number, topologies). Equal noise acts with and without the effects. `ratio` is the rms
change over the noise floor, of the channel where it is largest.
"""

import copy
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.config.files import write_text
from rtctl.proof.batch import DRAFT, MACHINES_MIX, Progress, batch
from rtctl.proof.machines import TOPOLOGIES, build, draw
from rtctl.proof.machines.effect import TABLE, UnfitError, level, measure, names_ok, nodes_ok
from rtctl.proof.machines.setup import Setup
from rtctl.proof.machines.simulate import HIDDEN, Run, channels, floors, healthy, largest, simulate, visibility
from rtctl.proof.machines.unknown import UNKNOWN

ATTEMPTS, DRAWS = 5, 120  # most simulated machines, and most drawn machines, for one case
WANT = {"unknown": 6.0}  # least ratio of a case by kind; else 4, or 1 at a tenth of the size

Json = dict[str, Any]
Found = tuple[float, Setup, Run, Json]  # worst ratio, setup, recording, answer


def sound(p: draw.Plan, topology: str, seed: list[int]) -> tuple[Setup, Run, Run, int] | None:
    """Machine without missing physics for the plan's effects, its runs with two noise seeds, and gain reductions.

    The gain of the loop is reduced until it works. None where it never works, or where an effect has no node.
    """
    rng = np.random.default_rng(seed)
    s = build.sound(topology, rng, p.how, draw.needs(p), p.kind == "parameters")
    if any(not _where(name, s) for name in p.names):
        return None
    if p.decoy == "noise_colour":
        s.hidden.colour = float(rng.uniform(0.8, 0.97))
        s.hidden.push_sd = 2.0 * s.hidden.push_sd
    for lowered in range(4):
        a, b = simulate(s, [*seed, 1]), simulate(s, [*seed, 2])
        if a is not None and b is not None and healthy(s, a) and _quiet(s, a, b):
            return s, a, b, lowered
        if s.open_loop:
            return None
        for gain in ("kp", "kd", "ki", "ki_settle"):
            s.law[gain] *= 0.6
    return None


def _where(name: str, s: Setup) -> list[str]:
    return UNKNOWN[name][1](s) if name in UNKNOWN else TABLE[name].where(s)


def _quiet(s: Setup, a: Run, b: Run) -> bool:
    """Whether the loop does not chatter: two noise seeds give nearly equal readings."""
    floor = floors(s, a, b)
    return all(floor[c] < max(12.0 * quantum, 1.5e-3 * float(np.std(a[c]))) for c, quantum in s.columns)


def put(s: Setup, p: draw.Plan, seed: list[int], size: float, leave: int = -1) -> tuple[Setup, list[Json]]:
    """Copy of the machine with the plan's effects without number `leave`, and their entries in the answers.

    Raises UnfitError where an effect is invisible on this machine.
    """
    s, said = copy.deepcopy(s), []
    for k, name in enumerate(p.names):
        rng = np.random.default_rng([*seed, 3, k])
        places = _where(name, s)
        if not places:
            raise UnfitError(f"no place for {name}")
        node = places[rng.integers(len(places))]
        if k == leave:
            continue
        make = UNKNOWN[name][0] if name in UNKNOWN else TABLE[name].make
        sizes = make(s, node, size, rng)
        axes = () if name in UNKNOWN else TABLE[name].axes
        said.append(
            {"name": name, "names_ok": sorted(names_ok(s, name, node)), "node": node,
             "nodes_ok": sorted(nodes_ok(s, name, node)), "axes_ok": list(axes),
             "sizes": {key: rounded(v) for key, v in sizes.items()}}
        )  # fmt: skip
    return s, said


def make(seed: int, i: int, topologies: tuple[str, ...] = TOPOLOGIES) -> tuple[Setup, Run, Json]:
    """Case `i` (from 0): setup with its effects, recording and answer. Raises RuntimeError if no machine fits."""
    return carry_out(draw.plan(seed, i, topologies), [seed, i])


def carry_out(p: draw.Plan, seed: list[int]) -> tuple[Setup, Run, Json]:
    """Setup with the effects of a plan, recording and answer. Raises RuntimeError if no machine fits."""
    want = WANT.get(p.kind, 1.0 if p.size == 0.1 else 4.0 * math.sqrt(p.size or 1.0))
    best: Found | None = None
    simulated = 0
    for attempt in range(DRAWS):
        if simulated >= ATTEMPTS and best is not None:
            break
        root = [*seed, 200 + attempt]
        found = sound(p, p.topologies[attempt // 3 % len(p.topologies)], root)
        if found is None:
            continue
        base, a, b, lowered = found
        measure(base, a)
        simulated += 1
        try:
            tried = conceal(p, base, a, floors(base, a, b), root, lowered)
        except UnfitError:
            continue
        if tried is not None and (best is None or tried[0] > best[0]):
            best = tried
        if best is not None and best[0] >= want:
            break
    if best is None:
        raise RuntimeError(f"seed {seed}: no machine for {p.kind} {' and '.join(p.names)} on {', '.join(p.topologies)}")
    return best[1], best[2], best[3]


def conceal(p: draw.Plan, base: Setup, a: Run, floor: dict[str, float], root: list[int], lowered: int) -> Found | None:
    """Case with the plan's effects in a machine with run `a`; None where the loop then fails."""
    if p.decoy == "gust":
        i = base.body(base.base)
        base.hidden.gust[i] = 1.5 * level(base, base.base)
        base.hidden.gust_at = float(np.random.default_rng([*root, 4]).uniform(0.2, 0.8))
        blown = simulate(base, [*root, 1])
        if blown is None:
            return None
        a = blown
    if not p.names:
        return math.inf, base, a, answer(p, base, [], a, floor, visibility(base, a, a, floor), lowered)
    size = float(p.size or 1.0)
    s, said = put(base, p, root, size)
    run = simulate(s, [*root, 1])
    if run is None or not healthy(s, run):
        return None
    seen = visibility(s, run, a, floor)
    worst = largest(seen)
    if len(p.names) > 1:
        for k in range(len(p.names)):
            lacking = simulate(put(base, p, root, size, leave=k)[0], [*root, 1])
            without = largest(visibility(s, run, lacking, floor)) if lacking is not None else math.inf
            said[k]["ratio"] = rounded(min(without, 1e6))
            worst = min(worst, without)
    return worst, s, run, answer(p, s, said, run, floor, seen, lowered)


def answer(
    p: draw.Plan, s: Setup, said: list[Json], run: Run, floor: dict[str, float], seen: dict[str, dict[str, float]],
    lowered: int,
) -> Json:  # fmt: skip
    """Entry of answers.json, with the keys of the practice answers; numbers rounded to six digits."""
    rms = {c: float(np.sqrt(np.mean(run[c] ** 2))) for c in channels(s)}
    main = s.columns[s.sensor(s.control)][0]
    out: Json = {
        "decoy": p.decoy, "effects": said, "excitation": p.how, "gain_reductions": lowered, "kind": p.kind,
        "noise_floor": {k: rounded(v) for k, v in floor.items()}, "open_loop": s.open_loop,
        "oracle_nrmse": rounded(floor[main] / max(rms[main], 1e-30)), "plant": s.topology, "topology": s.topology,
        "ratio": rounded(largest(seen)), "rich_variant": False, "rms": {k: rounded(v) for k, v in rms.items()},
        "sample_rate": rounded(1.0 / s.Ts), "seconds": rounded(s.n * s.Ts), "size": p.size, "stable": True,
        "true_parameters": {k: rounded(v) for k, v in s.truth.items()},
        "visibility": {c: {k: rounded(v) for k, v in row.items()} for c, row in seen.items()},
    }  # fmt: skip
    if p.decoy == "gust":
        out["unnamed_ok"] = True
    return out


def rounded(value: float) -> float:
    """Value rounded to six digits."""
    return float(f"{value:.6g}")


def write_bundle(folder: Path, s: Setup, run: Run) -> None:
    """Write recording.parquet and case.json; counters as 32-bit integers."""
    import pyarrow as pa

    from rtctl.trace.bundle import save_case, write_parquet

    folder.mkdir(parents=True, exist_ok=True)
    counters = {x["column"] for x in s.machine["sensors"].values() if "counts_per_unit" in x}
    columns = {k: pa.array(v.astype(np.int32) if k in counters else v) for k, v in run.items() if k not in HIDDEN}
    group = pa.RecordBatch.from_arrays(list(columns.values()), names=list(columns))
    write_parquet(folder, [group], group.schema)
    save_case(folder, s.case)


def write_case(folder: Path, seed: int, i: int, topologies: tuple[str, ...], heldout: bool) -> tuple[str, Json]:
    """Generate and write case `i` (from 0); returns its name and answer. `heldout` adds a second motion."""
    s, run, said = make(seed, i, topologies)
    name = f"case-{i + 1:04d}"
    write_bundle(folder / name, s, run)
    for attempt in range(20 if heldout else 0):
        other = copy.deepcopy(s)
        other.ref, other.w = other.play(np.random.default_rng([seed, i, 5, attempt]))
        second = simulate(other, [seed, i, 6, attempt])
        if second is not None and healthy(other, second):
            write_bundle(folder / f"{name}-heldout", other, second)
            break
    (folder / DRAFT).mkdir(exist_ok=True)
    write_text(folder / DRAFT / f"{name}.json", json.dumps(said))
    return name, said


def generate(
    folder: Path | str, count: int, seed: int, topologies: tuple[str, ...] = TOPOLOGIES,
    progress: Progress | None = None, jobs: int = 1, heldout: bool = False,
) -> Path:  # fmt: skip
    """Write `count` cases, their answers and the seal into `folder`, and return it. Continues an interrupted run.

    Raises UserError for a folder with cases, for `count` 0 and for an unknown topology.
    """
    bad = [t for t in topologies if t not in TOPOLOGIES]
    if bad or not topologies:
        raise UserError(f"machines: '{bad[0] if bad else ''}' is not one of {', '.join(TOPOLOGIES)}")
    which = tuple(t for t in TOPOLOGIES if t in topologies)
    order = {"seed": seed, "machines": list(which), "heldout": heldout}
    return batch(
        Path(folder), count, order, write_case, (seed, which, heldout), MACHINES_MIX.format(seed), 2, progress, jobs
    )
