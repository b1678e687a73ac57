import pytest
from graph_cases import PENDULUM, case_of

from rtctl.case.format2 import read_case
from rtctl.config.errors import UserError
from rtctl.diagnose.model.model import nominal


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"physics": {"term": "friction.coulomb"}}, "physics should be a list of objects with 'term', 'node'"),
        ({"physics": [{"node": "rod"}]}, "physics should be a list of objects with 'term', 'node'"),
        (
            {"physics": [{"term": "friction.columb", "node": "rod"}]},
            "physics.0.term: there is no term 'friction.columb'; did you mean 'friction.coulomb'?",
        ),
        ({"physics": [{"term": "friction.coulomb", "node": "rod"}]}, "physics.0: missing key 'F_C'"),
        (
            {"physics": [{"term": "friction.coulomb", "node": "motor", "F_C": 1.0}]},
            "physics.0.node: friction.coulomb cannot stand at 'motor'; it can at rod",
        ),
        ({"inputs": []}, "inputs is a list; it should be an object of names and columns"),
        ({"inputs": {"wind": {"body": "rod"}}}, "inputs.wind"),
        ({"inputs": {"wind": {"body": "rodd", "column": "f"}}}, "there is no body 'rodd'; did you mean 'rod'?"),
    ],
)
def test_invalid_known_terms_are_refused(change, sentence):
    with pytest.raises(UserError, match=r"^bench/case\.json: ") as error:
        read_case(case_of(PENDULUM) | change, "bench")
    assert sentence in str(error.value)


def test_parameters_of_known_terms_are_fitted_by_path():
    known = [{"term": "friction.stribeck", "node": "rod", "F_s": 0.006, "v_s": 0.3}]
    tolerance = {"default": 0.1, "physics.0.F_s": 0.5, "physics.0.v_s": 0.0}
    case = read_case(case_of(PENDULUM, physics=known) | {"tolerance": tolerance}, "bench")
    assert "physics.0.F_s" in case.fitted
    assert "physics.0.v_s" not in case.fitted
    assert case.tolerance("physics.0.F_s") == 0.5
    model = nominal(case)
    moved = model._replace(base={**model.base, "physics.0.F_s": 0.008}).resolved()
    assert (moved.terms[0].F_s, moved.terms[0].v_s) == (0.008, 0.3)
