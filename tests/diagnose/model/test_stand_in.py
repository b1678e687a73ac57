"""Stand-in law for machines with an unknown law."""

import numpy as np
from graph_cases import at_rest

from rtctl.cli.common import load_config
from rtctl.diagnose.model import loop
from rtctl.diagnose.model.loop_of import loop_of
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator

SECONDS = 2.0


def test_record_without_a_config_gets_a_stand_in_law():
    record = at_rest(load_config("machines/belt", []), SECONDS)
    bare = record._replace(case=record.case._replace(config=None))
    at = loop_of(bare)
    assert not at.known
    reference = 3.0 * (1.0 - np.cos(np.pi * record.t))
    out, volts = loop.run(Simulator(bare), at, nominal(record.case), reference, record.w)
    assert np.abs(out[:, 0] - reference).max() < 1.0
    assert np.abs(volts).max() < at.limit
