"""--fail-on: metric.statistic, a comparison, a number."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.campaign.conditions import STATISTICS, judge, parse, statistic
from rtctl.config.errors import UserError

METRICS = ("final_error_mm", "settling_s")
X = np.array([0.1, 0.2, np.nan, 0.4])


@pytest.mark.parametrize(
    ("text", "failed", "value"),
    [
        ("final_error_mm.max > 0.3", True, 0.4),
        ("final_error_mm.max>0.4", False, 0.4),
        ("final_error_mm.max >= .4", True, 0.4),
        ("final_error_mm.count < 4", True, 3.0),
        ("final_error_mm.share != 0.75", False, 0.75),
        ("final_error_mm.median == 2e-1", True, 0.2),
        ("trip.count > 0", True, 1.0),
        ("error.share > 0", False, 0.0),
        ("settling_s.p99 > 5", True, np.nan),  # no run has the metric
    ],
)
def test_conditions_are_judged(text: str, failed: bool, value: float) -> None:
    columns = {"final_error_mm": X, "settling_s": np.full(4, np.nan)}
    columns |= {"trip": np.array([True, False, False, False]), "error": np.zeros(4, bool)}
    found = judge(parse(text, METRICS), columns, 4, None)
    assert found.failed == failed
    assert found.value == value or np.isnan(value)
    assert text in found.words and ("cannot be judged" in found.words) == np.isnan(value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("final_eror_mm.p99 > 0.1", "did you mean 'final_error_mm'?"),
        ("final_error_mm.p98 > 0.1", "did you mean"),
        ("final_error_mm > 0.1", "not a condition"),
        ("final_error_mm.p99 > 0.1 mm", "not a condition"),
        ("__import__('os').system('true')", "not a condition"),
        ("trip.max > 1", "there is count, share"),
        ("regressions.max > 0", "there is count"),
        ("", "not a condition"),
        ("x" * 10_000, "not a condition"),
    ],
)
def test_invalid_condition_is_refused(text: str, words: str) -> None:
    with pytest.raises(UserError, match="fail-on") as caught:
        parse(text, METRICS)
    assert words in str(caught.value) and len(str(caught.value)) < 500


def test_regressions_need_a_baseline() -> None:
    condition = parse("regressions.count > 0", METRICS)
    assert judge(condition, {}, 4, 1).failed and not judge(condition, {}, 4, 0).failed
    with pytest.raises(UserError, match="--baseline"):
        judge(condition, {}, 4, None)


@given(st.text(max_size=60))
@settings(deadline=None)
def test_any_text_is_a_condition_or_a_user_error(text: str) -> None:
    try:
        parse(text, METRICS)
    except UserError as error:
        assert str(error)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=30))
@settings(deadline=None)
def test_statistics_are_ordered_from_min_to_max(values: list[float]) -> None:
    x = np.array([*values, np.nan])
    found = {name: statistic(name, x, len(x)) for name in STATISTICS}
    assert found["min"] <= found["median"] <= found["p90"] + 1e-9 <= found["p95"] + 2e-9 <= found["p99"] + 3e-9
    assert found["p99"] <= found["max"] + 1e-9
    assert statistic("count", x, len(x)) == len(values)
