"""Cases of format 1 in the diagnosis of described machines."""

import numpy as np
import pytest

from rtctl.case.format1 import read_case
from rtctl.diagnose.answer.format1_config import read_model, write_model
from rtctl.diagnose.model.by_symbol import owner_model
from rtctl.diagnose.model.format1 import graph_record, known_model
from rtctl.diagnose.model.loop_of import loop_of
from rtctl.diagnose.model.model import nominal, rigid
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.model.space import Space
from rtctl.diagnose.record.format1 import check
from rtctl.plants.physics import TERMS

RATE, N = 500.0, 1200
CASE = {
    "format": 1, "plant": "ivu", "sample_rate": RATE, "delay_samples": 1.0, "controller": {"kind": "none"},
    "parameters": {"R1": 0.036, "R2": 0.024, "c1": 500.0, "tau_F1": 3e-3, "d_tape": 1e-6},
    "sensors": {"capstan_counts_per_rev": 10000, "reel_counts_per_rev": 209},
    "drive": {"amp_per_volt": [0.2, 0.25], "limit_volt": 10.0, "bandwidth_hz": 300.0},
    "reaches": {"parameter_tolerance": 0.1, "radius_tolerance": 0.02},
}  # fmt: skip


def known_record():
    t = np.arange(N) / RATE
    angle = 20.0 * np.sin(2 * np.pi * 0.4 * t)

    def edges(radius):
        at = np.floor(angle * 0.0125 / radius * 209 / (2 * np.pi))
        return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(at)))])

    columns = {
        "t": t, "ref": angle, "w": 0.0 * t, "u1": 0.5 + np.sin(t), "u2": 0.5 - np.sin(t),
        "capstan_counts": np.floor(angle * 10000 / (2 * np.pi)),
        "reel1_counts": edges(0.036), "reel2_counts": edges(-0.024),
    }  # fmt: skip
    return graph_record(check(columns, read_case(CASE, "."), "."))


def test_symbols_set_the_parameters_of_the_description():
    case = known_record().case
    assert case.values["joints.tape1.stiffness"] == 500.0
    assert case.values["bodies.reel2.reel.thickness"] == 1e-6
    assert case.values["drives.drive2.gain"] == 0.25
    assert case.values["drives.drive1.bandwidth_hz"] == 300.0
    assert case.machine.drives["drive1"].unit == "V"
    assert case.tolerance("bodies.reel1.radius") == 0.02
    assert case.tolerance("joints.tape1.stiffness") == 0.1
    assert case.tolerance("bodies.capstan.radius") == 0.0
    assert case.tolerance("drives.drive1.gain") == 0.0
    assert case.called["bodies.motor1.dry"] == "tau_F1"


def test_parameters_of_one_symbol_change_together():
    case = known_record().case
    both = ("bodies.reel1.reel.thickness", "bodies.reel2.reel.thickness")
    assert both[0] in case.fitted
    assert both[1] not in case.fitted
    model = Space(nominal(case), (both[0],), case.tolerance).model(np.array([0.05]))
    assert model.base[both[0]] == model.base[both[1]] == pytest.approx(1e-6 * np.exp(0.05))


def test_tape_couples_the_reels_by_their_radii():
    case = known_record().case
    ratios = rigid(case.layout, case.values, "capstan")
    assert ratios["motor1"] == pytest.approx(0.0125 / 0.036)
    assert ratios["reel2"] == pytest.approx(-0.0125 / 0.024)


def test_reel_edges_get_their_direction_from_the_tracked_capstan():
    record = known_record()
    assert list(record.y) == ["encoder"]
    assert set(record.edges) == {"reel1", "reel2"}
    sim = Simulator(record)
    told = sim.directed(nominal(record.case))
    assert told.channels == ["encoder", "reel1", "reel2"]
    for name, ratio in (("reel1", 0.0125 / 0.036), ("reel2", -0.0125 / 0.024)):
        off = told.record.y[name] - ratio * record.y["encoder"]
        assert np.ptp(off) < 2.5 * told.record.grain[name]  # quantisation and the position of the first edge


def test_reel_without_edges_has_no_channel():
    told = Simulator(known_record()).directed(nominal(known_record().case))
    still = told.record._replace(edges={name: np.zeros(len(told.record.t)) for name in told.record.edges})
    assert Simulator(still).directed(nominal(still.case)).channels == ["encoder"]


def test_model_is_written_in_the_symbols_of_format_1(tmp_path):
    record = known_record()
    source, path = record.source, "joints.tape1.stiffness"
    model = Space(nominal(record.case), (path,), record.case.tolerance).model(np.array([0.1]))
    term = TERMS["friction.coulomb"].settings(term="friction.coulomb", node="motor1", F_C=1e-3)
    found = known_model(model.add(term), record)
    owner = owner_model(source.case, source)
    assert found.base == owner.base | {"c1": pytest.approx(500.0 * np.exp(0.1))}
    assert found.terms == (term,)
    file = write_model(found, source, tmp_path / "model.yaml")
    again = read_model(file, source)
    assert again.base["c1"] == pytest.approx(500.0 * np.exp(0.1), rel=1e-5)
    assert again.terms[0].F_C == 1e-3


def test_unknown_law_is_replaced_by_a_stand_in():
    record = known_record()
    at = loop_of(record)
    assert not at.known
    assert at.sensor == "encoder"
    assert at.give[0, 0] == -at.give[1, 0] == pytest.approx(0.5)  # one motor per direction
    assert at.beside == pytest.approx(np.median(record.u, axis=0))
