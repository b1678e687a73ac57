import json

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rtctl.diagnose.answer.results import finite


@given(st.recursive(st.floats() | st.integers() | st.none() | st.text(), lambda c: st.lists(c) | st.tuples(c, c)))
def test_finite_values_are_valid_json(value):
    json.dumps(finite({"value": value, "array": np.array([1.0, np.inf])}), allow_nan=False)
