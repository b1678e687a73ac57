"""Motion and reflected inertia of jointed bodies, against closed forms."""

import numpy as np
import pytest
from graph_cases import BELT, case_of

from rtctl.case.format2 import read_case
from rtctl.diagnose.model.model import carried, moved_inertia, nominal, rigid
from rtctl.diagnose.model.stand_in import lowest_mode


@pytest.mark.parametrize("stiffness", [4e4, None])
@pytest.mark.parametrize(("main", "inertia"), [("motor", 4e-5 + 1.5 * 0.0127**2), ("carriage", 1.5 + 4e-5 / 0.0127**2)])
def test_moved_inertia_includes_all_jointed_bodies(main, inertia, stiffness):
    joint = BELT["joints"]["belt"] if stiffness else {"from": "motor", "to": "carriage", "ratio": 0.0127}
    model = nominal(read_case(case_of({**BELT, "joints": {"belt": joint}}), "bundle"))
    moved = carried(model.layout, model.base, rigid(model.layout, model.base, main))
    assert len(moved) == (2 if stiffness else 1)
    assert moved_inertia(model.params(1e-3).inertia, moved) == pytest.approx(inertia)


def test_lowest_mode_matches_the_belt_mode():
    """w^2 = k (n^2 / J + 1 / m)."""
    model = nominal(read_case(case_of(BELT), "bundle"))
    hertz = np.sqrt(4e4 * (0.0127**2 / 4e-5 + 1.0 / 1.5)) / (2 * np.pi)
    assert lowest_mode(model.layout.machine, model.params(1e-3)) == pytest.approx(hertz, rel=1e-6)


def test_removing_a_known_term_keeps_the_parameters_of_the_others():
    known = [{"term": "friction.coulomb", "node": "carriage", "F_C": F} for F in (1.0, 2.0, 3.0)]
    model = nominal(read_case(case_of(BELT, physics=known), "bundle"))
    rest = model.without_known(1)
    assert rest.known() == 2
    assert [term.F_C for term in rest.resolved().terms] == [1.0, 3.0]
    assert {p: v for p, v in rest.base.items() if p.startswith("bodies")} == {
        p: v for p, v in model.base.items() if p.startswith("bodies")
    }
