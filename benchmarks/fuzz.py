"""Fuzzing of all readers of external input with a million invalid inputs.

    python benchmarks/fuzz.py [--json] [--inputs N] [--seed N] [--target NAME ...] [--patience S]

Inputs are valid messages, frames, configs and recordings with some bytes or some values changed: bits, lengths, depth,
types, names, numbers. Each target (tests/fuzz/targets.py) runs in a process of its own with bounded memory. A finding
is an undeclared exception, a warning, the death of the process, an input that takes longer than `--patience`, or an
input that takes 256 MiB. Exit code 1 where there is a finding.
"""

import argparse
import json
import math
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "fuzz"))


def fuzz(inputs: int, names: list[str], seed: int, patience: float, show: bool) -> dict[str, Any]:
    """Run `inputs` inputs in total, distributed by the shares of the targets; returns the result of `--json`."""
    from harness import run
    from targets import TARGETS

    whole = sum(TARGETS[name].share for name in names)
    began, outcomes = time.monotonic(), []
    for name in names:
        kind = TARGETS[name]
        outcome = run(name, kind, math.ceil(inputs * kind.share / whole), seed, patience)
        outcomes.append(outcome)
        if show:
            slowest = f"slowest {outcome.slowest_s * 1e3:6.1f} ms, {len(outcome.findings)} findings"
            print(f"{name:10} {outcome.inputs:8} inputs {outcome.seconds:7.1f} s, {slowest}", flush=True)
            for finding in outcome.findings:
                print(f"    {finding.what}\n    {finding.input[:200]!r}", flush=True)
    return {
        "inputs": sum(outcome.inputs for outcome in outcomes),
        "findings": [finding.as_dict() for outcome in outcomes for finding in outcome.findings],
        "seconds": round(time.monotonic() - began, 1),
        "seed": seed,
        "targets": {
            outcome.target: {
                "inputs": outcome.inputs,
                "seconds": outcome.seconds,
                "slowest_ms": round(outcome.slowest_s * 1e3, 2),
                "findings": len(outcome.findings),
            }
            for outcome in outcomes
        },
    }


def main() -> int:
    from targets import TARGETS

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--inputs", type=int, default=1_000_000, help="number of inputs of all targets together")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--target", action="append", choices=list(TARGETS), help="only this target; may be repeated")
    parser.add_argument("--patience", type=float, default=5.0, help="time limit of one input, s")
    given = parser.parse_args()
    result = fuzz(given.inputs, given.target or list(TARGETS), given.seed, given.patience, not given.json)
    if given.json:
        print(json.dumps(result))
    else:
        print(f"{result['inputs']} inputs in {result['seconds']:.0f} s, {len(result['findings'])} findings")
    return 1 if result["findings"] else 0


if __name__ == "__main__":
    sys.exit(main())
