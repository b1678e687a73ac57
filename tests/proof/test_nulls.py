import numpy as np
import pytest

from rtctl.proof.nulls import nulls, p_value


def answer(nothing):
    """Diagnosis with probability `nothing` for the nominal model."""
    return {
        "probabilities": [{"effects": [], "probability": nothing}, {"effects": ["a:b"], "probability": 1 - nothing}]
    }


def cases(count, plant="belt"):
    return {f"case-{i}": {"kind": "null", "plant": plant, "effects": []} for i in range(count)}


@pytest.mark.parametrize(("nothing", "p"), [(0.9, 1.0), (0.5, 1.0), (0.25, 1 / 3), (0.0, 1e-4 / (1 - 1e-4))])
def test_probability_of_the_nominal_model_gives_a_p_value(nothing, p):
    assert p_value(answer(nothing)) == pytest.approx(p)


def test_missing_answer_has_no_p_value():
    assert p_value(None) is None
    assert p_value({"verdict": "nothing"}) is None


def test_uniform_p_values_pass_the_uniformity_test_and_small_ones_fail():
    uniform = np.linspace(0.01, 0.99, 50)
    right = {f"case-{i}": answer(p / (1 + p)) for i, p in enumerate(uniform)}
    small = {f"case-{i}": answer(p / (1 + p)) for i, p in enumerate(uniform**3)}
    assert nulls(cases(50), right)["p_value"] > 0.5
    assert nulls(cases(50), small)["p_value"] < 1e-3


def test_null_cases_are_counted_per_plant_and_cases_with_effects_are_excluded():
    answers = {**cases(2), "case-2": {"kind": "single", "plant": "arm", "effects": [{}]}}
    answers |= {"case-3": {"kind": "parameters", "plant": "arm", "effects": []}}
    found = nulls(answers, {name: answer(0.9) for name in answers})
    assert found["cases"] == 3
    assert {plant: one["cases"] for plant, one in found["by_plant"].items()} == {"arm": 1, "belt": 2}
    assert nulls({}, {})["p_value"] is None
