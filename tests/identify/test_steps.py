"""Steps: printing steps of the linear drive, a radian of the reel unit as in figure 8.6."""

import bench_runs as runs
import numpy as np
import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.identify import steps as st


@pytest.mark.parametrize("size", [st.TWELFTH, st.TWENTY_FOURTH])
def test_printing_steps_of_the_linear_drive(size):
    result = st.steps(runs.played(st.printing_config, "ldu_printer", size, 6))
    assert len(result.each) == 12
    assert st.size_mm(result) == pytest.approx(1e3 * size)
    assert sum(step["size"] for step in result.each) == pytest.approx(0.0, abs=1e-12)
    assert abs(result.worst_mm) < 0.15 * 1e3 * size
    assert result.spread_mm < 2e-3


def test_radian_steps_of_the_reel_unit_agree_with_figure_8_6():
    """(a) overshoots with 2.4 mNm compensated, (b) with 1.5 mNm does not; the error is below that of the thesis."""
    a, b = (st.steps(runs.played(st.radian_config, "ivu", tau)) for tau in (2.4e-3, 1.5e-3))
    assert [np.sign(step["final_error_rad"]) for step in a.each] == [
        1,
        -1,
    ]  # as 9.77e-3 and -1.06e-2: beyond
    assert a.overshoot_pct > 0.0 and b.overshoot_pct == 0.0
    for result in (a, b):
        assert [step["size"] for step in result.each] == pytest.approx([-1.0, 1.0])
        assert max(abs(step["final_error_rad"]) for step in result.each) < 1.06e-2
        assert abs(result.worst_mm) < 0.1  # accuracy of the redesign


def test_default_configs_of_step_experiments():
    assert len(st.usual_configs(runs.config("ldu"))) == len(st.usual_configs(runs.config("ivu"))) == 2
    with pytest.raises(UserError, match="for ivu and ldu, not for axis"):
        st.usual_configs(runs.config("axis"))


def test_record_without_steps_has_no_answer():
    columns = {"target": np.zeros(1000), "position": np.zeros(1000)}
    with pytest.raises(NoAnswer, match="makes no step"):
        st.steps(runs.made("ldu", columns))
