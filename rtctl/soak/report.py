"""Report of a soak: a JSON summary, JUnit XML for a CI server, and lines for a terminal."""

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from rtctl.soak.events import Day
from rtctl.soak.invariants import INVARIANTS, NAMES
from rtctl.tick.safety import TRIPS
from rtctl.trace.bundle import as_json

SUMMARY = "summary.json"
TIMES = ("wall_s", "memory_mb")  # fields that differ between two runs of one day


def summary(day: Day, wall_s: float, memory_mb: float, mode: str, out: Path) -> dict[str, Any]:
    """The summary as `--json` prints it: `violations` is their number, `violation_list` the first ones."""
    rig, checker = day.rig, day.rig.checker
    carry, rate = checker.carry, rig.machine.rate
    return {
        "machine": rig.machine.kind,
        "name": rig.machine.config.name,
        "mode": mode,
        "seed": day.seed,
        "violations": int(carry["episodes"].sum()),
        "violation_list": [v.as_json() for v in checker.kept],
        "simulated_hours": round(rig.tick / rate / 3600.0, 6),
        "wall_s": round(wall_s, 3),
        "ticks": rig.tick,
        "rows": {"recorded": int(carry["rows"]), "lost": int(carry["lost"])},
        "events": dict(sorted(day.events.items())),
        "moves": day.moves,
        "faults": {
            kind: {"injected": n, "tripped": day.tripped[kind], "recovered": day.recovered[kind]}
            for kind, n in sorted(day.injected.items())
        },
        "trips": {TRIPS[i][0]: int(n) for i, n in enumerate(carry["by_cause"]) if n},
        "invariants": {name: int(carry["checked"][i]) for i, name in enumerate(NAMES)},
        "violated": {name: int(carry["episodes"][i]) for i, name in enumerate(NAMES) if carry["episodes"][i]},
        "memory_mb": round(memory_mb, 1),
        "out": str(out),
    }


def as_text(found: dict[str, Any]) -> str:
    """The summary as JSON text for its file; NaN and infinity become null."""
    return as_json({**found, "violation_list": [_numbers(v) for v in found["violation_list"]]}, indent=1) + "\n"


def _numbers(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _numbers(item) for key, item in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value


def junit(found: dict[str, Any], path: Path) -> None:
    """Write JUnit XML with one test case for each invariant. Raises OSError."""
    failures = len(found["violated"])
    skipped = sum(not n for n in found["invariants"].values())
    suite = ElementTree.Element(
        "testsuite", name=f"rtctl soak {found['name']}", tests=str(len(NAMES)), failures=str(failures), errors="0",
        skipped=str(skipped), time=str(found["wall_s"]),
    )  # fmt: skip
    for name, words in INVARIANTS.items():
        case = ElementTree.SubElement(
            suite, "testcase", classname=f"rtctl.soak.{found['machine']}", name=name, time="0"
        )  # fmt: skip
        if name in found["violated"]:
            told = [v for v in found["violation_list"] if v["name"] == name]
            failure = ElementTree.SubElement(case, "failure", message=f"{words}: {found['violated'][name]} violations")
            failure.text = "\n".join(map(sentence, told))
        elif not found["invariants"][name]:
            ElementTree.SubElement(case, "skipped", message="not checked on this machine or in this mode")
    path.parent.mkdir(parents=True, exist_ok=True)
    ElementTree.indent(suite)
    ElementTree.ElementTree(suite).write(path, encoding="utf-8", xml_declaration=True)


def sentence(v: dict[str, Any]) -> str:
    """A violation as one line of text."""
    where = f", see {v['bundle']}" if v["bundle"] else ""
    return (
        f"{v['name']} at tick {v['tick']}, event {v['event']} of seed {v['seed']}: "
        f"{v['value']:.6g}, allowed {v['bound']:.6g}{where}"
    )


def words(found: dict[str, Any]) -> list[str]:
    """The summary as lines for a terminal."""
    faults = found["faults"].values()
    speed = found["simulated_hours"] * 3600.0 / found["wall_s"] if found["wall_s"] else 0.0
    lines = [
        f"{found['simulated_hours']:.2f} h of {found['name']} in {found['wall_s']:.0f} s ({speed:.0f} x), "
        f"{found['ticks']} ticks, seed {found['seed']}",
        f"{found['moves']} moves, {sum(f['injected'] for f in faults)} faults, "
        f"{sum(found['trips'].values())} trips, {sum(f['recovered'] for f in faults)} recovered",
    ]
    for name, ticks in found["invariants"].items():
        bad = found["violated"].get(name, 0)
        mark = "FAIL" if bad else "ok  " if ticks else "-   "
        lines.append(f"{mark} {name:20}{ticks:>12}  {INVARIANTS[name]}" + (f": {bad} violations" if bad else ""))
    lines += [sentence(v) for v in found["violation_list"]]
    lines.append(f"{found['violations'] or 'no'} violations; {found['out']}")
    return lines
