"""Comparison of identification methods on real recordings: free-run error on held-out rows, CPU time, and a name.

    python benchmarks/identification_peers.py [--json] [--only METHOD...] BUNDLE...

Every method gets equal rows of bundles of one body and one drive (`rtctl import`, examples/real). It fits the first
three quarters. From position and speed at the first row of the last quarter it runs freely to the end under the
recorded command. The error is rms over the standard deviation of the readings. Needs `pip install casadi cma
"pysindy>=2" jax`.

    description   the nominal model with fitted numbers
    shooting      CasADi: multiple shooting of the nominal structure with viscous and dry friction, as in nlgreyfast
    cma           CMA-ES over one fixed friction model, as in PACE and BAM
    pysindy       sparse regression on a library of terms
    neural        a neural state-space model
    rtctl         `rtctl diagnose` of the rows to fit
"""

import argparse
import importlib
import json
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

METHODS = {
    "description": ("ours", "nominal", "none"),
    "shooting": ("shooting", "fit", "none: numbers of a structure that was given"),
    "cma": ("evolution", "fit", "none: numbers of a friction model that was given"),
    "pysindy": ("sparse_ode", "fit", "terms of an equation, without a place"),
    "neural": ("neural", "fit", "none"),
    "rtctl": ("ours", "fit", ""),
}


def measured(p: Any, method: str) -> dict[str, Any]:
    """Error, CPU time and name of one method on one problem; the reason where it fails."""
    module, function, name = METHODS[method]
    try:
        run: Callable[..., Any] = getattr(importlib.import_module(f"identification.{module}"), function)
    except ImportError as error:
        return {"skipped": str(error)}
    began = time.process_time()
    try:
        free, numbers, *verdict = run(p)
    except Exception as error:  # failure of a library: reported
        return {"failed": f"{type(error).__name__}: {error}"[:200], "cpu_s": round(time.process_time() - began, 1)}
    error = p.error(np.asarray(free))
    return {
        "heldout_nrmse": round(error, 6) if np.isfinite(error) else None,
        "cpu_s": round(time.process_time() - began, 1),
        "name": verdict[0] if verdict else name,
        "numbers": {key: float(f"{value:.4g}") for key, value in numbers.items()},
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundles", nargs="+", type=Path, metavar="BUNDLE")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--only", nargs="+", choices=METHODS, default=list(METHODS), help="some of the methods")
    given = parser.parse_args()
    from identification.records import problem

    warnings.simplefilter("ignore")
    found: dict[str, Any] = {}
    for folder in given.bundles:
        p = problem(folder)
        found[p.name] = {"rows": len(p.seen), "predicted_rows": len(p.seen) - p.first}
        for method in given.only:
            found[p.name][method] = one = measured(p, method)
            if not given.json:
                print(f"{p.name:24} {method:12} {one}", flush=True)
            else:
                print(p.name, method, one, file=sys.stderr, flush=True)
    if given.json:
        print(json.dumps(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
