"""The closed loop of a described machine against the loop that the daemon runs."""

import numpy as np

from rtctl.case.format2 import read_case
from rtctl.cli.common import load_config
from rtctl.config.load import set_path
from rtctl.diagnose.model import loop
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.model.simulate import Simulator
from rtctl.loop import fused

SECONDS = 2.0


def blank(config):
    """A record of a config's machine at rest."""
    case = {
        "format": 2, "sample_rate": config.loop.rate, "delay_samples": 1.0, "tolerance": {"default": 0.15},
        "machine": config.machine.model_dump(mode="json", exclude_unset=True),
        "config": config.model_dump(mode="json", exclude_unset=True),
    }  # fmt: skip
    read, n = read_case(case, "."), round(SECONDS * config.loop.rate)
    t = np.arange(n) / config.loop.rate
    sensors = read.machine.sensors
    grain = {name: abs(s.grain / s.scale) for name, s in sensors.items()}
    still = {name: np.zeros(n) for name in sensors}
    return GraphRecord(read, t, t[1], t * 0.0, t * 0.0, np.zeros((n, len(read.machine.drives))), still, grain, None)


def test_it_is_the_loop_of_the_tick():
    config = set_path(load_config("machines/belt", []), "loop.mode", "fused")
    run = fused.run(config, SECONDS + 0.5)
    rows = run.between(0.0, SECONDS)
    record = blank(config)
    at = loop.loop_of(record)
    assert at.known
    assert (at.sensor, at.unit, at.limit) == ("encoder", "rad", 10.0)
    out, volts = loop.run(Simulator(record), at, nominal(record.case), rows["target"], rows["w"])
    scale = record.case.machine.sensors["encoder"].scale
    assert np.abs(np.floor(out[:, 0] * scale) - rows["encoder_counts"]).max() <= 2
    assert np.abs(volts[:, 0] - rows["u"]).max() < 0.02 * np.abs(rows["u"]).max()


def test_without_a_config_the_law_is_a_stand_in():
    record = blank(load_config("machines/belt", []))
    bare = record._replace(case=record.case._replace(config=None))
    at = loop.loop_of(bare)
    assert not at.known
    reference = 3.0 * (1.0 - np.cos(np.pi * record.t))
    out, volts = loop.run(Simulator(bare), at, nominal(record.case), reference, record.w)
    assert np.abs(out[:, 0] - reference).max() < 1.0
    assert np.abs(volts).max() < at.limit
