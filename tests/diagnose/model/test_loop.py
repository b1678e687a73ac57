"""Simulated closed loop of a described machine against the loop of the daemon."""

import numpy as np
from graph_cases import at_rest

from rtctl.cli.common import load_config
from rtctl.config.load import set_path
from rtctl.diagnose.model import loop
from rtctl.diagnose.model.loop_of import loop_of
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator
from rtctl.loop import fused

SECONDS = 2.0


def test_simulated_loop_matches_the_loop_of_the_daemon():
    config = set_path(load_config("machines/belt", []), "loop.mode", "fused")
    run = fused.run(config, SECONDS + 0.5)
    rows = run.between(0.0, SECONDS)
    record = at_rest(config, SECONDS)
    at = loop_of(record)
    assert at.known
    assert (at.sensor, at.unit, at.limit) == ("encoder", "rad", 10.0)
    out, volts = loop.run(Simulator(record), at, nominal(record.case), rows["target"], rows["w"])
    scale = record.case.machine.sensors["encoder"].scale
    assert np.abs(np.floor(out[:, 0] * scale) - rows["encoder_counts"]).max() <= 2
    assert np.abs(volts[:, 0] - rows["u"]).max() < 0.02 * np.abs(rows["u"]).max()
