import numpy as np
import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.reproduce import played


def test_configs_are_the_shipped_ones_in_fused_mode():
    made = played.config("ldu_printer", {"law.limit.high": 2.0})
    assert (made.name, made.machine, made.loop.mode, made.law.limit.high) == ("ldu_printer", "ldu", "fused", 2.0)
    with pytest.raises(UserError, match="gian"):
        played.config("ivu", {"law.position.gian": 1.0})


def test_reel_radii_are_set_for_laws_and_emulator():
    made = played.reels(0.03, 0.025, {"radius.d_tape": 0.0})
    assert (made.radius.R1, made.plant.parameters.R1) == (0.03, 0.03)
    assert (made.radius.R2, made.plant.parameters.R2, made.radius.d_tape) == (0.025, 0.025, 0.0)


def test_tripped_run_error_names_the_time():
    assert np.ptp(played.play(played.config("ivu"), 1.0)["trip"]) == 0
    stuck = {"plant.parameters.tau_F1": 1.0, "reference": {"steps": [{"at": 0.1, "to": 1.0}]}}
    with pytest.raises(NoAnswer, match=r"ivu: the run tripped, \w+ at \d\.\d+ s"):
        played.play(played.config("ivu", stuck), 4.0)


def test_loop_gain_is_one_at_the_crossover():
    f = np.geomspace(0.3, 30.0, 25)
    S = 1 / (1 + (2.0 / f) ** 2 * np.exp(-2.5j))
    assert played.crossover(f, S) == pytest.approx(2.0, rel=1e-6)
    with pytest.raises(NoAnswer, match=r"does not fall through 1 from 0\.3 to 1 Hz"):
        played.crossover(np.array([0.3, 1.0]), 1 / (1 + np.array([9.0, 4.0])))
