"""False alarms of `rtctl trend` on stationary series, and detection of shifts, on simulated series of 40 estimates.

python benchmarks/trend_alarms.py [--json] [--series N] [--length N]
"""

import argparse
import json
import sys
from typing import Any

import numpy as np

from rtctl.trend.change_points import changes

STATIONARY = {"white": (0.0, np.inf), "t3": (0.0, 3.0), "ar_0.5": (0.5, np.inf), "ar_0.9": (0.9, np.inf),
              "ar_0.95": (0.95, np.inf)}  # fmt: skip
SHIFTS = (2.0, 3.0, 4.0, 6.0)  # shifts in standard deviations of an estimate


def stationary(rng: np.random.Generator, n: int, phi: float, dof: float) -> np.ndarray:
    """Stationary autoregression (n,) with unit variance in the Gaussian case."""
    e = rng.standard_normal(n) if np.isinf(dof) else rng.standard_t(dof, n)
    x = e.copy()
    for k in range(1, n):
        x[k] = phi * x[k - 1] + np.sqrt(1.0 - phi**2) * e[k]
    return x


def measure(series: int, n: int) -> dict[str, Any]:
    """Alarms on stationary series, and shares of detected shifts."""
    rng = np.random.default_rng(0)
    at, where = np.arange(float(n)), 5 * n // 8

    def alarms(y: np.ndarray) -> bool:
        return bool(changes(y, np.ones(n), at)[0])

    false = {name: sum(alarms(stationary(rng, n, *kind)) for _ in range(series)) for name, kind in STATIONARY.items()}
    step = at >= where
    found = {
        str(size): sum(alarms(stationary(rng, n, 0.0, np.inf) + size * step) for _ in range(series // 10))
        for size in SHIFTS
    }
    return {
        "series": series,
        "length": n,
        "false_alarms": false,
        "bound": round(0.2 * 0.05 / 0.95 * series, 1),
        "found_share": {size: round(10 * count / series, 3) for size, count in found.items()},
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--series", type=int, default=2000, help="series of each kind; a tenth of shifts of each size")
    parser.add_argument("--length", type=int, default=40, help="estimates of a series")
    given = parser.parse_args()
    found = measure(given.series, given.length)
    if given.json:
        print(json.dumps(found))
        return 0
    print(f"of {given.series} stationary series (bound {found['bound']}):", found["false_alarms"])
    print("shifts found, by size in scatters of an estimate:", found["found_share"])
    return 0


if __name__ == "__main__":
    sys.exit(main())
