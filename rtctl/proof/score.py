"""Scores of diagnoses against the opened answers: names, nodes, axes, false alarms, intervals, calibration, time.

Kinds `null`, `parameters` and `decoy` have no missing physics. A single effect scores 1 where it is named first, and
0.5 among at most three names of an `ambiguous` verdict. Effects below `visible` times the noise floor count separately.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable
from typing import Any

from rtctl.proof.nulls import nulls

NOTHING_MISSING = ("null", "parameters", "decoy")
VERDICTS = ("named", "ambiguous", "unnamed", "nothing")
BINS = 10
CALLED = {  # size in the answers -> name in a diagnosis
    "offset_V": ("offset",), "band_V": ("band",), "limit_V": ("limit",), "tau_s": ("tau",), "asymmetry": ("a",),
    "travel": ("z_s",), "amplitude_m": ("A",), "amplitude_rad": ("A",), "amplitude_Nm": ("A",), "amplitude_N": ("A",),
    "wavelength_m": ("wavelength", "turn"), "at_m": ("at",), "force_N": ("F",), "width_m": ("width",),
    "torque_Nm": ("A",), "k_N_per_m": ("k",), "eccentricity_m": ("a", "e"), "mass_kg": ("mass",), "rms_s": ("sigma",),
    "gap_rad": ("gap",), "gap_m": ("gap",), "limit_N": ("F_max",),
}  # fmt: skip
Json = dict[str, Any]


def wilson(k: int, n: int, z: float = 1.959964) -> list[float | None]:
    """95 % interval of a share (Wilson 1927)."""
    if n == 0:
        return [None, None]
    p, d = k / n, 1 + z * z / n
    middle = (p + z * z / (2 * n)) / d
    half = z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / d
    return [round(max(0.0, middle - half), 4), round(min(1.0, middle + half), 4)]


def mean(values: Iterable[float | None]) -> float | None:
    found = [v for v in values if v is not None]
    return round(sum(found) / len(found), 4) if found else None


def given(d: Json | None) -> list[Json]:
    """Effects of a diagnosis, best first, at most three."""
    return [e for e in (d or {}).get("effects") or [] if isinstance(e, dict) and isinstance(e.get("name"), str)][:3]


def confidence(e: Json) -> float:
    c = e.get("confidence")
    number = float(c) if isinstance(c, int | float) and not isinstance(c, bool) else 1.0
    return min(max(number, 0.0), 1.0)


def admits(d: Json | None, effect: Json) -> bool:
    """Whether the diagnosis reports this effect as untestable."""
    for said in (d or {}).get("cannot_test") or []:
        name, _, node = str(said.get("name", "") if isinstance(said, dict) else said).partition(":")
        if name == effect["name"] and (not node or node in effect["nodes_ok"]):
            return True
    return False


def same(effect: Json, name: Any) -> bool:
    """Whether `name` is the true name or equivalent to it on this machine (`names_ok` of the answer)."""
    return bool(name == effect["name"] or name in effect.get("names_ok", ()))


def canonical(a: Json, names: list[str]) -> list[str]:
    """Answered names, each once, with equivalents of a true effect replaced by the true name."""
    out: list[str] = []
    for name in names:
        true = [e["name"] for e in a["effects"]]
        hits = [t for t in true if t == name] or [e["name"] for e in a["effects"] if same(e, name)]
        out.append(hits[0] if hits and hits[0] not in out else name)
    return out


def row_of(a: Json) -> str:
    if a["kind"] in (*NOTHING_MISSING, "unknown"):
        return str(a["kind"])
    return "+".join(sorted(e["name"] for e in a["effects"]))


def column_of(a: Json, verdict: str, names: list[str]) -> str:
    if verdict != "named":
        return verdict
    if not names:
        return "named:empty"
    return "+".join(sorted(names)) if a["kind"] in ("pair", "triple") else names[0]


def gap_closed(d: Json | None) -> float | None:
    """Share of the held-out error above the floor explained by the named effects, -1 to 1."""
    fit = (d or {}).get("fit") or {}
    try:
        before, after, floor = (float(fit[k]) for k in ("heldout_nrmse_before", "heldout_nrmse_after", "noise_floor"))
    except (KeyError, TypeError, ValueError):
        return None
    if not math.isfinite(before + after + floor) or before - floor <= 1e-9 or before <= 1.05 * floor:
        return None
    return max(-1.0, min(1.0, (before - after) / (before - floor)))


def coverage(pairs: list[tuple[Any, float]]) -> tuple[int, int]:
    """Number of 90 % intervals in `pairs` (ci90, true value) that contain the truth, and number of intervals."""
    held = total = 0
    for ci, true in pairs:
        if isinstance(ci, list | tuple) and len(ci) == 2 and all(isinstance(x, int | float) for x in ci):
            total += 1
            held += min(ci) <= true <= max(ci)
    return held, total


def reliability(scored: list[tuple[float, float]]) -> Json:
    """Brier score, expected calibration error and its table, from pairs (confidence, right or not)."""
    table, ece = [], 0.0
    for b in range(BINS):
        inside = [(c, y) for c, y in scored if b / BINS <= c < (b + 1) / BINS or (b == BINS - 1 and c == 1.0)]
        if not inside:
            continue
        c_mean, right = sum(c for c, _ in inside) / len(inside), sum(y for _, y in inside) / len(inside)
        ece += len(inside) / len(scored) * abs(c_mean - right)
        table.append({"from": b / BINS, "to": (b + 1) / BINS, "names": len(inside), "confidence": round(c_mean, 4),
                      "right": round(right, 4)})  # fmt: skip
    brier = round(sum((c - y) ** 2 for c, y in scored) / len(scored), 4) if scored else None
    return {"brier": brier, "ece": round(ece, 4) if scored else None, "names": len(scored), "table": table}


def score(answers: Json, diagnoses: dict[str, Json | None], visible: float = 0.3, seconds: Json | None = None) -> Json:
    """Scores of all cases. `answers` is the opened file or its "cases"; `diagnoses` maps a case to its diagnosis.json.

    A case without a valid diagnosis counts as missing, and as a failure. `seconds` maps a case to its time.
    """
    cases: Json = answers.get("cases", answers)
    S: dict[str, Any] = defaultdict(list)
    confusion: dict[str, Counter[str]] = defaultdict(Counter)
    by_size: dict[str, list[float]] = defaultdict(list)
    by_name: dict[str, list[float]] = defaultdict(list)
    found_at: dict[str, list[tuple[float, bool]]] = defaultdict(list)
    failures = []
    for case, a in sorted(cases.items()):
        d = diagnoses.get(case)
        if not isinstance(d, dict) or d.get("verdict") not in VERDICTS:
            d = None
        verdict = d["verdict"] if d else "missing"
        S["missing"] += [case] * (d is None)
        effects = given(d)
        nameless = a["kind"] in (*NOTHING_MISSING, "unknown")
        names, true = canonical(a, [e["name"] for e in effects]), [] if nameless else [e["name"] for e in a["effects"]]
        confusion[row_of(a)][column_of(a, verdict, names)] += 1
        if verdict == "named":
            right = [float(n in true) for n in names] or [0.0]
            S["named"] += right
            judged = [(confidence(e), float(n in true)) for e, n in zip(effects, names, strict=True)]
            S["calibration"] += judged
            S["calibration_named"] += [] if nameless else judged
        S["base_ci"] += _base_intervals(a, d)
        if a["kind"] in NOTHING_MISSING:
            alarm = d is not None and verdict != "nothing" and not (verdict == "unnamed" and a.get("unnamed_ok"))
            S["null"].append((a["kind"], alarm, verdict == "named"))
            if alarm or d is None:
                failures.append(_failure(case, a, verdict, names))
            continue
        if a["kind"] == "unknown":
            S["unknown"].append(verdict == "named")
            if a["ratio"] >= visible:
                S["noticed"].append(float(verdict in ("unnamed", "ambiguous")))
                if verdict in ("unnamed", "ambiguous"):
                    node = ((d or {}).get("located") or {}).get("node")
                    S["located"].append(float(node in a["effects"][0]["nodes_ok"]))
            if verdict == "named" or d is None:
                failures.append(_failure(case, a, verdict, names))
            continue
        S["gap"] += [gap_closed(d)]
        S["effect_ci"] += _effect_intervals(a, effects)
        if a["kind"] == "single":
            points = _single(S, a, d, verdict, names, visible)
            if points is not None:
                by_size[str(a["size"])].append(points)
                by_name[true[0]].append(points)
                found_at[true[0]].append((a["ratio"], points == 1.0))
            if points is not None and points < 1.0:
                failures.append(_failure(case, a, verdict, names))
        else:
            found = sum(n in names for n in true) if verdict in ("named", "ambiguous") else 0
            extra = sum(n not in true for n in names) if verdict == "named" else 0
            S[a["kind"]].append((found, len(true), extra))
            if found < len(true) or extra:
                failures.append(_failure(case, a, verdict, names))
    result = _result(cases, S, by_size, by_name)
    result["smallest_ratio_found"] = {n: _smallest(x) for n, x in sorted(found_at.items())}
    result["recall_by_name"] = {n: round(sum(x) / len(x), 3) for n, x in sorted(by_name.items())}
    result["confusion"] = {row: dict(sorted(columns.items())) for row, columns in sorted(confusion.items())}
    result["failures"] = failures
    result["nulls"] = nulls(cases, diagnoses)
    if len(plants := sorted({a["plant"] for a in cases.values()})) > 1:
        result["by_plant"] = {p: _brief({c: a for c, a in cases.items() if a["plant"] == p}, diagnoses) for p in plants}
    times = sorted(float(v) for v in (seconds or {}).values())
    result["seconds"] = {"median": times[len(times) // 2], "longest": times[-1], "sum": sum(times)} if times else None
    return result


def _brief(cases: Json, diagnoses: dict[str, Json | None]) -> Json:
    """Scores of one plant or topology: shares with numbers of cases."""
    R = score(cases, diagnoses)
    typical = R["single"]["by_size"].get("1.0", {"cases": 0, "top1": None})
    return {
        "cases": R["cases"], "missing": R["missing"], "single": R["single"]["top1"], "singles": R["single"]["cases"],
        "typical": typical["top1"], "typicals": typical["cases"], "node": R["node_accuracy"],
        "false_alarms": R["null"]["false_alarms"], "nulls": R["null"]["cases"],
        "false_names": R["unknown"]["false_names"], "unknowns": R["unknown"]["cases"],
        "pairs_found": R["pair"]["all_found"], "pairs": R["pair"]["cases"],
    }  # fmt: skip


def _single(S: Any, a: Json, d: Json | None, verdict: str, names: list[str], visible: float) -> float | None:
    """Points of a single effect, None where it is invisible; fills nodes, axes and invisible cases in S."""
    effect = a["effects"][0]
    if a["ratio"] < visible:
        right = verdict == "named" and names[:1] == [effect["name"]]
        S["invisible"].append(verdict == "nothing" or admits(d, effect) or right)
        return None
    points = 0.0
    everything = [e for e in (d or {}).get("effects") or [] if isinstance(e, dict)]
    if verdict == "named" and names[:1] == [effect["name"]]:
        points = 1.0
    elif verdict == "ambiguous" and len(everything) <= 3 and any(same(effect, e.get("name")) for e in everything):
        points = 0.5
    if points > 0:
        exact = [e for e in everything if e.get("name") == effect["name"]]
        hit = (exact or [e for e in everything if same(effect, e.get("name"))])[0]
        S["node"].append(float(hit.get("node") in effect["nodes_ok"]))
        axis = ((d or {}).get("located") or {}).get("axis")
        S["axis"].append(float(axis in effect["axes_ok"]) if effect["axes_ok"] else None)
    return points


def _base_intervals(a: Json, d: Json | None) -> list[tuple[Any, float]]:
    found = (d or {}).get("parameters") or {}
    return [(v.get("ci90"), a["true_parameters"][n]) for n, v in found.items()
            if isinstance(v, dict) and n in a["true_parameters"]]  # fmt: skip


def _effect_intervals(a: Json, effects: list[Json]) -> list[tuple[Any, float]]:
    """Pairs (ci90, true size) of effects with the right name and node."""
    out = []
    for e in effects:
        said = e.get("parameters") or {}
        for true in a["effects"]:
            if e["name"] == true["name"] and e.get("node") in true["nodes_ok"]:
                for key, size in true["sizes"].items():
                    known = next((k for k in (key, *CALLED.get(key, ())) if isinstance(said.get(k), dict)), None)
                    out += [(said[known].get("ci90"), size)] if known else []
    return out


def _smallest(found: list[tuple[float, bool]]) -> Json:
    """Smallest ratio to the floor with a right name, number named and number of cases."""
    hits = [ratio for ratio, right in found if right]
    return {"ratio": round(min(hits), 3) if hits else None, "found": len(hits), "of": len(found)}


def _failure(case: str, a: Json, verdict: str, names: list[str]) -> Json:
    return {"case": case, "plant": a["plant"], "kind": a["kind"], "truth": row_of(a), "size": a["size"],
            "ratio": a["ratio"], "verdict": verdict, "names": names}  # fmt: skip


def _result(cases: Json, S: Any, by_size: dict[str, list[float]], by_name: dict[str, list[float]]) -> Json:
    points = [p for x in by_size.values() for p in x]
    alarms, named = sum(x[1] for x in S["null"]), sum(x[2] for x in S["null"])
    n_null, n_unknown, false = len(S["null"]), len(S["unknown"]), sum(S["unknown"])
    gap = sorted(g for g in S["gap"] if g is not None)
    base, effect = coverage(S["base_ci"]), coverage(S["effect_ci"])
    result: Json = {
        "cases": len(cases), "missing": len(S["missing"]),
        "single": {
            "cases": len(points), "top1": mean(points), "macro_recall": mean(sum(x) / len(x) for x in by_name.values()),
            "by_size": {s: {"cases": len(x), "top1": mean(x)} for s, x in sorted(by_size.items(), reverse=True)},
            "invisible_cases": len(S["invisible"]), "invisible_fine": mean(float(x) for x in S["invisible"]),
        },
        "node_accuracy": mean(S["node"]), "axis_accuracy": mean(S["axis"]),
        "named_precision": mean(S["named"]), "names_given": len(S["named"]),
        "null": {
            "cases": n_null,
            "missing": sum(c in S["missing"] for c, a in cases.items() if a["kind"] in NOTHING_MISSING),
            "false_alarms": alarms, "false_alarm_rate": round(alarms / n_null, 4) if n_null else None,
            "wilson95": wilson(alarms, n_null), "false_named": named, "false_named_wilson95": wilson(named, n_null),
            "by_kind": {k: [sum(x[1] for x in S["null"] if x[0] == k), sum(x[0] == k for x in S["null"])]
                        for k in NOTHING_MISSING},
        },
        "unknown": {
            "cases": n_unknown, "false_names": false, "wilson95": wilson(false, n_unknown),
            "false_name_rate": round(false / n_unknown, 4) if n_unknown else None,
            "noticed": mean(S["noticed"]), "located_node": mean(S["located"]),
        },
        "heldout_gap_closed": {"cases": len(gap), "mean": mean(gap),
                               "median": round(gap[len(gap) // 2], 4) if gap else None},
        "intervals": {"base": {"held": base[0], "of": base[1]}, "effects": {"held": effect[0], "of": effect[1]}},
        "calibration": reliability(S["calibration"]),
    }  # fmt: skip
    for kind in ("pair", "triple"):
        x = S[kind]
        result[kind] = {
            "cases": len(x), "all_found": mean(float(f == t) for f, t, _ in x),
            "at_least_one": mean(float(f > 0) for f, _, _ in x), "recall": mean(f / t for f, t, _ in x),
            "exactly": mean(float(f == t and e == 0) for f, t, e in x),
            "extra_names_per_case": mean(float(e) for _, _, e in x),
        }  # fmt: skip
    if S["calibration_named"]:
        result["brier"] = reliability(S["calibration_named"])["brier"]  # of the cases with effects of the table
    return result
