"""Scorer: hand-made diagnoses, and agreement with the scorer of the practice cases."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from rtctl.proof import report
from rtctl.proof.score import reliability, score, wilson

SHARED = Path(__file__).parents[3] / "shared" / "blind"


def case(kind, names=(), size=1.0, ratio=20.0):
    effects = [
        {"name": n, "node": "motor1", "nodes_ok": ["motor1"], "axes_ok": ["velocity"], "sizes": {"F": 1.0}}
        for n in names
    ]
    return {
        "kind": kind, "plant": "ivu", "size": size, "ratio": ratio, "effects": effects, "true_parameters": {"J": 2.0},
    }  # fmt: skip


def named(*names, confidence=0.9, node="motor1"):
    return {
        "verdict": "named", "located": {"node": node, "axis": "velocity"},
        "effects": [{"name": n, "node": node, "confidence": confidence} for n in names],
    }  # fmt: skip


def test_scores_of_each_kind_of_case():
    answers = {
        "a": case("single", ["friction.coulomb"]), "b": case("single", ["drive.lag"], 0.3),
        "c": case("null", size=None),
        "d": case("unknown", ["unknown.x"]), "e": case("pair", ["drive.lag", "ripple.reel"]),
        "f": case("single", ["drive.offset"], 0.1, 0.1),
    }  # fmt: skip
    diagnoses = {
        "a": named("friction.coulomb"), "b": {"verdict": "ambiguous", "effects": [{"name": "drive.lag"}]},
        "c": {"verdict": "unnamed"}, "d": named("drive.lag"), "e": named("drive.lag", "load.bump"),
        "f": {"verdict": "nothing"},
    }  # fmt: skip
    R = score({"cases": answers}, diagnoses, seconds={"a": 2.0, "b": 4.0})
    assert R["single"]["top1"] == 0.75
    assert R["single"]["by_size"] == {"1.0": {"cases": 1, "top1": 1.0}, "0.3": {"cases": 1, "top1": 0.5}}
    assert (R["single"]["invisible_cases"], R["single"]["invisible_fine"]) == (1, 1.0)
    assert R["null"]["false_alarms"] == 1
    assert R["null"]["false_named"] == 0
    assert R["unknown"]["false_name_rate"] == 1.0
    assert (R["pair"]["all_found"], R["pair"]["at_least_one"], R["pair"]["extra_names_per_case"]) == (0.0, 1.0, 1.0)
    assert {f["case"] for f in R["failures"]} == {"b", "c", "d", "e"}
    assert R["confusion"]["friction.coulomb"] == {"friction.coulomb": 1}
    assert R["seconds"]["sum"] == 6.0
    assert R["smallest_ratio_found"]["friction.coulomb"] == {"ratio": 20.0, "found": 1, "of": 1}
    assert "friction.coulomb" in report.markdown(R)


def test_interval_coverage_counts_the_true_values():
    d = named("friction.coulomb")
    d["parameters"] = {"J": {"value": 1.9, "ci90": [1.8, 2.1]}}
    d["effects"][0]["parameters"] = {"F": {"value": 2.0, "ci90": [1.5, 2.5]}}
    R = score({"a": case("single", ["friction.coulomb"])}, {"a": d})
    assert R["intervals"] == {"base": {"held": 1, "of": 1}, "effects": {"held": 0, "of": 1}}


def test_calibrated_confidences_have_a_small_calibration_error():
    rng = np.random.default_rng(1)
    c = rng.random(20000)
    right = (rng.random(20000) < c).astype(float)
    fair = reliability(list(zip(c.tolist(), right.tolist(), strict=True)))
    assert fair["ece"] < 0.02
    sure = reliability([(1.0, y) for y in right.tolist()])
    assert sure["ece"] == pytest.approx(0.5, abs=0.02)


def test_invalid_diagnosis_counts_as_missing():
    R = score({"a": case("single", ["drive.lag"]), "b": case("null", size=None)}, {"a": {"verdict": "maybe"}})
    assert R["missing"] == 2
    assert R["single"]["top1"] == 0.0


def test_wilson_interval():
    low, high = wilson(0, 59)
    assert low == 0
    assert 0.055 < high < 0.065
    assert wilson(0, 0) == [None, None]


@pytest.mark.skipif(not (SHARED / "score.py").exists(), reason="no practice cases here")
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_scores_agree_with_the_scorer_of_the_practice_cases(seed):
    spec = importlib.util.spec_from_file_location("practice_score", SHARED / "score.py")
    theirs = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(theirs)
    answers = json.loads((SHARED / "practice" / "answers.json").read_text())["cases"]
    rng = np.random.default_rng(seed)
    diagnoses = {name: _random_diagnosis(rng, a) for name, a in answers.items() if rng.random() < 0.9}
    want = theirs.score(answers, diagnoses.get)[0]
    found = score(answers, diagnoses)
    for key in (
        "cases",
        "missing",
        "node_accuracy",
        "axis_accuracy",
        "named_precision",
        "names_given",
        "unknown",
        "null",
    ):
        assert found[key] == want[key], key
    assert found["single"] == want["single"]
    for kind in ("pair", "triple"):
        assert {k: found[kind][k] for k in want[kind]} == want[kind]
    assert found["heldout_gap_closed"] == want["heldout_gap_closed"]
    assert found.get("brier") == want.get("brier")


def _random_diagnosis(rng, a):
    """Random diagnosis: correct, partly correct or wrong."""
    true = [{"name": e["name"], "node": e["node"], "confidence": float(rng.random())} for e in a["effects"]]
    other = [{"name": "drive.lag", "node": "drive1", "confidence": float(rng.random())}]
    effects = [[], true, other, true[:1] + other, other + true][rng.integers(5)]
    return {
        "verdict": str(rng.choice(["named", "named", "ambiguous", "unnamed", "nothing"])), "effects": effects,
        "located": {"node": str(rng.choice(["motor1", "carriage"])), "axis": str(rng.choice(["velocity", "command"]))},
        "cannot_test": [f"{e['name']}:{e['node']}" for e in true[:1]] if rng.random() < 0.3 else [],
        "fit": {"heldout_nrmse_before": 0.5, "heldout_nrmse_after": float(rng.random()) / 2, "noise_floor": 0.05},
    }  # fmt: skip
