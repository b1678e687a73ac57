"""Calibration of a diagnosis on machines without missing physics, by the Bayes factor against the nominal model.

A Bayes factor B for "something is missing" has the mean 1 over recordings of machines without missing physics.
Therefore 1/B is at most u in at most a share u of the recordings: it is a conservative p-value. A one-sided
Kolmogorov-Smirnov test compares 1/B with the uniform distribution.

Source: Kass & Raftery, Bayes factors, JASA 90 (1995); Shafer et al., Test martingales, Bayes factors and p-values,
Statistical Science 26 (2011).
"""

from collections import defaultdict
from typing import Any

Json = dict[str, Any]
SOUND = ("null", "parameters")  # kinds of cases without missing physics
LEAST = 1e-4  # smaller probabilities are not in diagnosis.json


def p_value(d: Json | None) -> float | None:
    """p-value 1/B (0 to 1) of a diagnosis, for equal priors of an effect and none; None without an answer."""
    if not d or "probabilities" not in d:
        return None
    nothing = sum(float(entry["probability"]) for entry in d["probabilities"] if not entry["effects"])
    nothing = max(nothing, LEAST)
    return 1.0 if nothing >= 0.5 else nothing / (1.0 - nothing)


def nulls(cases: Json, diagnoses: dict[str, Json | None]) -> Json:
    """One-sided Kolmogorov-Smirnov test of cases without missing physics, for all and by kind of machine.

    Number of cases, largest excess of the share of p-values up to u over u, and its p-value; None without cases.
    """
    found: dict[str, list[float]] = defaultdict(list)
    for name, answer in cases.items():
        p = p_value(diagnoses.get(name))
        if answer["kind"] in SOUND and p is not None:
            found[str(answer.get("plant"))].append(p)
    every = [p for values in found.values() for p in values]
    return {**_uniform(every), "by_plant": {plant: _uniform(values) for plant, values in sorted(found.items())}}


def _uniform(values: list[float]) -> Json:
    from scipy.stats import kstest

    if not values:
        return {"cases": 0, "excess": None, "p_value": None}
    test = kstest(values, "uniform", alternative="greater")
    return {"cases": len(values), "excess": round(float(test.statistic), 4), "p_value": round(float(test.pvalue), 4)}
