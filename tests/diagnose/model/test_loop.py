"""The closed loop of a described machine against the loop that the daemon runs."""

import numpy as np
from graph_cases import at_rest

from rtctl.cli.common import load_config
from rtctl.config.load import set_path
from rtctl.diagnose.model import loop
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator
from rtctl.loop import fused

SECONDS = 2.0


def test_it_is_the_loop_of_the_tick():
    config = set_path(load_config("machines/belt", []), "loop.mode", "fused")
    run = fused.run(config, SECONDS + 0.5)
    rows = run.between(0.0, SECONDS)
    record = at_rest(config, SECONDS)
    at = loop.loop_of(record)
    assert at.known
    assert (at.sensor, at.unit, at.limit) == ("encoder", "rad", 10.0)
    out, volts = loop.run(Simulator(record), at, nominal(record.case), rows["target"], rows["w"])
    scale = record.case.machine.sensors["encoder"].scale
    assert np.abs(np.floor(out[:, 0] * scale) - rows["encoder_counts"]).max() <= 2
    assert np.abs(volts[:, 0] - rows["u"]).max() < 0.02 * np.abs(rows["u"]).max()


def test_without_a_config_the_law_is_a_stand_in():
    record = at_rest(load_config("machines/belt", []), SECONDS)
    bare = record._replace(case=record.case._replace(config=None))
    at = loop.loop_of(bare)
    assert not at.known
    reference = 3.0 * (1.0 - np.cos(np.pi * record.t))
    out, volts = loop.run(Simulator(bare), at, nominal(record.case), reference, record.w)
    assert np.abs(out[:, 0] - reference).max() < 1.0
    assert np.abs(volts).max() < at.limit
