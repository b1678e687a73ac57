"""How others identify the machines of real recordings: free-run error on rows that no fit saw, CPU time, and a name.

    python benchmarks/identification_peers.py [--json] [--only METHOD...] BUNDLE...

Every method gets the same rows of bundles of one body and one drive (`rtctl import`, examples/real): the first three
quarters to fit, and position and speed at the first row of the last quarter, from which it runs freely to the end under
the recorded command. The error is rms by the spread of the readings. Needs `pip install casadi cma "pysindy>=2" jax`.

    description   the owner's description, its numbers fitted
    shooting      CasADi: multiple shooting of the owner's structure with viscous and dry friction, as nlgreyfast does
    cma           CMA-ES over one friction model chosen beforehand, as PACE and BAM do
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
    """Error, CPU time and name of one method on one problem; why it is missing where it is."""
    module, function, name = METHODS[method]
    try:
        run: Callable[..., Any] = getattr(importlib.import_module(f"identification.{module}"), function)
    except ImportError as error:
        return {"skipped": str(error)}
    began = time.process_time()
    try:
        free, numbers, *verdict = run(p)
    except Exception as error:  # of a library on a recording that it cannot take: told, not hidden
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
