"""Generation of concealed cases: draw, simulation with and without effects, check of visibility, bundle, answer.

A case depends only on (seed, number, plants). Equal noise acts with and without the effect: the effect alone causes the
change. `ratio` is the rms change over the rms change by another noise seed, of the channel where it is largest.
"""

import copy
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.config.files import write_text
from rtctl.proof import draw, plants, solver
from rtctl.proof.batch import DRAFT, MIX, PLANTS, Progress, batch
from rtctl.proof.effects import TABLE
from rtctl.proof.machine import NQ, NU, NY
from rtctl.proof.setup import Setup, draws
from rtctl.proof.unknown import UNKNOWN

ATTEMPTS, SIZES_TRIED = 6, 2  # number of machines, and of draws of sizes for each
WANT = {"unknown": 6.0}  # least ratio of a case by kind; else 4, or 1 at a tenth of the size
TOO_PLAIN, PLAIN = 120.0, 45.0  # ratio of unknown physics above which it is reduced, and its target
SATURATED = 0.3  # share of ticks at the limit above which a case is redrawn

Run = dict[str, np.ndarray]


def simulate(s: Setup, seed: list[int]) -> Run | None:
    """Columns of a recording and the true times; None where the loop was unstable."""
    a = draws(s, seed)
    y, u, start = np.zeros((s.n, NY)), np.zeros((s.n, NU)), np.zeros(2 * NQ)
    assert s.law is not None
    rows = solver.run(
        s.m[()], s.law[()], start, s.ref, s.w, a["ticks"], a["push"], a["spot"], a["extra"], a["lost"], y, u
    )
    if rows < s.n:
        return None
    out: Run = {"t": a["ticks"][:-1] if s.hidden.clock_tells else np.arange(s.n) * s.Ts, "ref": s.ref, "w": s.w}
    for d in range(int(s.m["nu"])):
        out[f"u{d + 1}" if s.m["nu"] > 1 else "u"] = u[:, d]
    for k, name in enumerate(s.sensors):
        out[name] = y[:, k] * (s.case["sensors"]["x_resolution_m"] if name == "x" else 1.0)
    return out


def channels(s: Setup) -> list[str]:
    return list(s.sensors) + (["u1", "u2"] if s.m["nu"] > 1 else ["u"])


def quantum(s: Setup, name: str) -> float:
    if name == "x":
        return float(s.case["sensors"]["x_resolution_m"])
    assert s.law is not None
    return float(s.law["step"]) if name[0] == "u" else 1.0


def floors(s: Setup, a: Run, b: Run) -> dict[str, float]:
    """Noise floor per channel: rms difference of two noise seeds, at least the rms of the quantum."""
    return {
        c: max(float(np.sqrt(np.mean((a[c] - b[c]) ** 2) / 2.0)), quantum(s, c) / math.sqrt(12.0)) for c in channels(s)
    }


def visibility(s: Setup, a: Run, b: Run, floor: dict[str, float]) -> dict[str, dict[str, float]]:
    out = {}
    for c in channels(s):
        change = float(np.sqrt(np.mean((a[c] - b[c]) ** 2)))
        out[c] = {"floor": floor[c], "rms_change": change, "ratio": change / floor[c]}
    return out


def largest(seen: dict[str, dict[str, float]]) -> float:
    return max(v["ratio"] for v in seen.values())


def healthy(s: Setup, run: Run | None) -> bool:
    """Whether the loop works: finite, follows its reference, not saturated, no chattering."""
    if run is None:
        return False
    assert s.law is not None
    error = s.ref - run[s.sensors[0]] * (1.0 if s.plant == "axis" else float(s.law["counts_to_q"]))
    if np.sqrt(np.mean(error**2)) > 0.5 * np.std(s.ref) + 1e-12 and np.abs(error).max() > np.ptp(s.ref):
        return False
    for c in ("u", "u1", "u2"):
        if c in run and np.mean(np.abs(run[c]) > 0.99 * float(s.law["limit"])) > SATURATED:
            return False
    return True


def sound(p: draw.Plan, seed: list[int]) -> tuple[Setup, Run, Run, int] | None:
    """Machine without missing physics, its runs with two noise seeds, and number of gain reductions until it works."""
    rng = np.random.default_rng(seed)
    s = plants.BUILD[p.plant](rng, p.how, p.kind == "parameters", p.decoy == "controller")
    if p.plant == "ldu" and len(s.sensors) == 1 and any(
        part.name in draw.NEED_SCALE or part.node == "scale" for part in p.parts
    ):  # fmt: skip
        s.sensors.append("scale_counts")
        s.case["sensors"]["scale_m_per_count"] = 5e-7
    if p.decoy == "noise_colour":
        s.hidden.colour = float(rng.uniform(0.8, 0.97))
        s.hidden.torque_sd = s.hidden.torque_sd * 2.0
    for lowered in range(4):
        a, b = simulate(s, [*seed, 1]), simulate(s, [*seed, 2])
        if healthy(s, a) and b is not None:
            assert a is not None
            floor = floors(s, a, b)
            main = s.sensors[0]
            if floor[main] < (6.0 if p.decoy is None else 60.0) * quantum(s, main) * (
                5.0 if p.plant == "axis" else 1.0
            ):
                return s, a, b, lowered
        lower_gain(s)
    return None


def lower_gain(s: Setup) -> None:
    """Reduce the gain of the loop by a quarter, in the case and in the law."""
    from rtctl.proof.law import from_case

    c = s.case["controller"]
    if not s.case["controller_known"]:
        assert s.law is not None
        for name in ("P", "D", "kp", "kv"):
            s.law[name] *= 0.75
        s.law["sections"][0, :3] *= 0.75
        return
    for name in ("P", "D", "I", "k", "kv"):
        if name in c:
            c[name] *= 0.75
    if "sections" in c:
        c["sections"][0][:3] = [0.75 * b for b in c["sections"][0][:3]]
    keep = float(s.law["counts_to_q"]) if s.law is not None else 1.0
    s.law = from_case(s.case)
    s.law["counts_to_q"] = keep


def measure_span(s: Setup, run: Run) -> None:
    """Set `s.span`: amplitudes of the sound machine, the scale of effect sizes."""
    us = [run[c] for c in ("u", "u1", "u2") if c in run]
    s.span["u_top"] = float(max(np.quantile(np.abs(u), 0.999) for u in us))
    for d, u in enumerate(us):
        s.span[f"u_rms{d}"] = float(np.sqrt(np.mean(u * u)))
        s.span["u_top" + str(d)] = float(np.quantile(np.abs(u), 0.998))
    f = s.truth["R_c"] if s.plant == "ldu" else 1.0
    x = run[s.sensors[0]] * (1.0 if s.plant == "axis" else 1.0 / float(s.m["y_gain"][0]))
    width = max(int(0.03 / s.Ts), 5)
    smooth = np.convolve(x, np.hanning(width + 2) / np.hanning(width + 2).sum(), "same")[width:-width]
    s.acceleration = np.abs(np.gradient(np.gradient(smooth, s.Ts), s.Ts))
    s.span["q_top"] = float(np.abs(s.ref).max() / f)


def put(s: Setup, parts: tuple[draw.Part, ...], seed: list[int]) -> tuple[Setup, list[dict[str, Any]]]:
    """Copy of the machine with these effects, and their entries in the answers."""
    s = copy.deepcopy(s)
    said = []
    for k, part in enumerate(parts):
        rng = np.random.default_rng([*seed, 3, k])
        if not part.name:
            continue  # left out; the others keep their draws
        if part.name in UNKNOWN:
            UNKNOWN[part.name][0](s, part.node, part.size, rng)
            said.append({"name": part.name, "node": part.node, "nodes_ok": [part.node], "axes_ok": [], "sizes": {}})
            continue
        entry = TABLE[part.name]
        sizes = entry.make(s, part.node, part.size, rng)
        ok = entry.alike.get(f"{s.plant}:{part.node}", entry.alike.get(s.plant, (part.node,)))
        said.append(
            {"name": part.name, "node": part.node, "nodes_ok": sorted({part.node, *ok}), "axes_ok": list(entry.axes),
             "sizes": {k: _round(v) for k, v in sizes.items()}}
        )  # fmt: skip
    return s, said


Found = tuple[float, Setup, Run, dict[str, Any]]  # worst ratio, setup, recording, answer


def make(seed: int, i: int, which: tuple[str, ...]) -> tuple[Setup, Run, dict[str, Any]]:
    """Case `i` (from 0): setup with its effects, recording and answer. Raises RuntimeError if none holds."""
    p = draw.plan(seed, i, which)
    best: Found | None = None
    want = WANT.get(p.kind, 1.0 if p.size == 0.1 else 4.0)
    for attempt in range(3 * ATTEMPTS):
        if best is not None and (best[0] >= want or attempt >= ATTEMPTS):
            break
        root = [seed, i, 10 + attempt]
        found = sound(p, root)
        if found is None:
            continue
        base, a, b, lowered = found
        measure_span(base, a)
        floor = floors(base, a, b)
        for again in range(SIZES_TRIED if p.parts else 1):
            tried = conceal(p, base, a, floor, [*root, again], root, lowered)
            if tried is not None and (best is None or tried[0] > best[0]):
                best = tried
            if best is not None and best[0] >= want:
                break
    if best is None:
        raise RuntimeError(f"case {i + 1} of seed {seed}: no machine of kind {p.kind} on {p.plant} holds its loop")
    return best[1], best[2], best[3]


def conceal(
    p: draw.Plan, base: Setup, a: Run, floor: dict[str, float], sizes: list[int], noise: list[int], lowered: int
) -> Found | None:
    """Case with the plan's effects in a sound machine with run `a`; None where the loop then fails."""
    if not p.parts:
        return math.inf, base, a, answer_of(p, base, [], a, floor, visibility(base, a, a, floor), lowered)
    s, said = put(base, p.parts, sizes)
    run = simulate(s, [*noise, 1])
    if run is None or not healthy(s, run):
        return None
    seen = visibility(s, run, a, floor)
    worst = largest(seen)
    if p.kind == "unknown" and worst > TOO_PLAIN:
        fewer = tuple(part._replace(size=part.size * max(0.05, PLAIN / worst)) for part in p.parts)
        less, less_said = put(base, fewer, sizes)
        softer = simulate(less, [*noise, 1])
        if softer is not None and healthy(less, softer):
            s, said, run = less, less_said, softer
            seen = visibility(s, run, a, floor)
            worst = largest(seen)
    if len(p.parts) > 1:
        for k in range(len(p.parts)):
            other, _ = put(base, tuple(q if j != k else q._replace(name="") for j, q in enumerate(p.parts)), sizes)
            lacking = simulate(other, [*noise, 1])
            without = largest(visibility(s, run, lacking, floor)) if lacking is not None else math.inf
            said[k]["ratio"] = _round(min(without, 1e6))
            worst = min(worst, without)
    return worst, s, run, answer_of(p, s, said, run, floor, seen, lowered)


def answer_of(
    p: draw.Plan, s: Setup, said: list[dict[str, Any]], run: Run, floor: dict[str, float],
    seen: dict[str, dict[str, float]], lowered: int,
) -> dict[str, Any]:  # fmt: skip
    """Entry of answers.json, with the keys of the practice answers."""
    rms = {c: float(np.sqrt(np.mean(run[c] ** 2))) for c in channels(s)}
    main = s.sensors[0]
    return {
        "decoy": p.decoy, "effects": said, "excitation": p.how, "gain_reductions": lowered, "kind": p.kind,
        "noise_floor": {k: _round(v) for k, v in floor.items()}, "oracle_nrmse": _round(floor[main] / rms[main]),
        "plant": p.plant, "ratio": _round(largest(seen)),
        "rich_variant": any(part.name in TABLE and TABLE[part.name].rich for part in p.parts),
        "rms": {k: _round(v) for k, v in rms.items()}, "seconds": s.n * s.Ts, "size": p.size, "stable": True,
        "true_parameters": {k: _round(v) for k, v in s.truth.items()},
        "visibility": {c: {k: _round(v) for k, v in row.items()} for c, row in seen.items()},
    }  # fmt: skip


def _round(value: float) -> float:
    return float(f"{value:.6g}")


def write_bundle(folder: Path, s: Setup, run: Run) -> None:
    """Write recording.parquet and case.json; counts as 32-bit integers."""
    import pyarrow as pa

    from rtctl.trace.bundle import save_case, write_parquet

    folder.mkdir(parents=True, exist_ok=True)
    columns = {k: pa.array(v.astype(np.int32) if k.endswith("_counts") else v) for k, v in run.items()}
    batch = pa.RecordBatch.from_arrays(list(columns.values()), names=list(columns))
    write_parquet(folder, [batch], batch.schema)
    save_case(folder, s.case)


def write_case(folder: Path, seed: int, i: int, which: tuple[str, ...], heldout: bool) -> tuple[str, dict[str, Any]]:
    """Generate and write case `i` (from 0); returns its name and its answer."""
    s, run, answer = make(seed, i, which)
    name = f"case-{i + 1:04d}"
    write_bundle(folder / name, s, run)
    if heldout:
        other = copy.deepcopy(s)
        assert other.play is not None
        for attempt in range(20):
            other.ref, other.w = other.play(np.random.default_rng([seed, i, 5, attempt]))
            second = simulate(other, [seed, i, 6, attempt])
            if second is not None and healthy(other, second):
                write_bundle(folder / f"{name}-heldout", other, second)
                break
    (folder / DRAFT).mkdir(exist_ok=True)
    write_text(folder / DRAFT / f"{name}.json", json.dumps(answer))
    return name, answer


def generate(
    folder: Path | str, count: int, seed: int, plants: tuple[str, ...] = PLANTS,
    progress: Progress | None = None, jobs: int = 1, heldout: bool = False,
) -> Path:  # fmt: skip
    """Write `count` cases, their answers and the seal into `folder`, and return it. Continues an interrupted run.

    `progress` is called with the number of finished cases and `count`. Raises UserError for a folder with cases, for
    `count` 0 and for a plant other than ivu, ldu or axis.
    """
    bad = [p for p in plants if p not in PLANTS]
    if bad or not plants:
        raise UserError(f"plants: '{bad[0] if bad else ''}' is not one of {', '.join(PLANTS)}")
    which = tuple(p for p in PLANTS if p in plants)
    order = {"seed": seed, "plants": list(which), "heldout": heldout}
    return batch(Path(folder), count, order, write_case, (seed, which, heldout), MIX.format(seed), 1, progress, jobs)
