"""Residual whiteness test: nominal model with fitted parameters, and an alarm where its residual is not white.

Source: Ljung & Box, Biometrika 65 (1978), as in the validation of system identification toolboxes.
"""

from typing import Any

import numpy as np
from scipy.stats import chi2

from baselines.form import diagnosis
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.model.format1 import graph_record
from rtctl.diagnose.record.format1 import Record

LAGS = 25
LEVEL = 0.01


def ljung_box(e: np.ndarray, lags: int = LAGS) -> float:
    """p-value of the hypothesis that e (n,) is white."""
    n = len(e)
    e = e - e.mean()
    power = float(e @ e)
    if power <= 0.0:
        return 1.0
    r = np.array([float(e[k:] @ e[:-k]) / power for k in range(1, lags + 1)])
    q = n * (n + 2) * float(np.sum(r**2 / (n - np.arange(1, lags + 1))))
    return float(chi2.sf(q, lags))


def diagnose(record: Record) -> dict[str, Any]:
    """Diagnosis `unnamed` where the residual is not white; never with a name."""
    error = refit(*together([graph_record(record)])).e
    worst = min(ljung_box(error[:, c]) for c in range(error.shape[1]))
    return diagnosis(record.plant, [], unnamed=worst < LEVEL)
