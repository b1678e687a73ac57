"""Adapter between an FMU and the loop: signed volts to its drives, counts and codes from its sensors."""

import numpy as np
import pytest

from rtctl import machines
from rtctl.config.errors import UserError
from rtctl.daemon import fmu_plant
from rtctl.drivers import daq_stc
from rtctl.loop.records import PLANT_STATUS
from rtctl.loop.shm_link import INPUTS_SLOT, OUTPUTS_SLOT
from rtctl.machines import check_plant
from rtctl.plants.fmu import FmuSettings
from rtctl.tick import safety

ANY = FmuSettings(file="any.fmu", inputs={}, outputs={})
STEP = 20 / 4096


class Scripted:
    """Stub of an FMU: outputs the readings of the test and records the volts."""

    def __init__(self, settings, drives, sensors, dt):
        self.readings = [0.0] * len(sensors)
        self.next = list(self.readings)
        self.volts = []
        assert [t.unit for t in drives] == ["V"] * len(drives)

    def tick(self, volts):
        self.volts.append(list(volts))
        self.readings = list(self.next)


@pytest.fixture
def plant(config, monkeypatch):
    monkeypatch.setattr(fmu_plant, "Fmu", Scripted)

    def make(kind):
        settings = config(kind, mode="lockstep", set={"plant.fmu": ANY})
        slots = np.zeros(1, INPUTS_SLOT), np.zeros(1, OUTPUTS_SLOT)
        return fmu_plant.FmuPlant(machines.build(settings), "shm", np.zeros(1, PLANT_STATUS), *slots)

    return make


def tick(plant, readings, codes, lines=0):
    """Run one tick with output `codes`; the FMU then outputs `readings`. Returns the next sample."""
    plant.fmu.next = readings
    plant.end.tx["ao_codes"][: len(codes)] = codes
    plant.end.tx["dio_lines"], plant.end.tx["state"] = lines, safety.RUNNING
    plant.advance()
    plant.card.read(plant.end.rx)
    return plant.end.rx


def test_fmu_of_the_ivu_has_two_drives_a_capstan_encoder_and_two_reel_sensors(plant):
    ivu = plant("ivu")
    sensor, half = 2 * np.pi / 209, 2.5 / 10 * 4096
    seen = tick(ivu, [2 * np.pi / 100, 0.5 * sensor, 0.0], (100, -200))
    assert ivu.fmu.volts == [[100 * STEP, -200 * STEP]]
    assert seen["counter_codes"][0] - daq_stc.INITIAL_COUNT == pytest.approx(100, abs=1)
    assert (seen["ai_codes"][0] < half) != (seen["ai_codes"][1] < half)  # one reel sensor dark, the other light


def test_direction_bit_sets_the_sign_of_the_ldu_volts(plant):
    ldu = plant("ldu")
    tick(ldu, [0.0, 0.0], (100,), lines=1)
    seen = tick(ldu, [-2 * np.pi / 400, 1e-5 + 1e-7], (100,), lines=0)
    assert ldu.fmu.volts == [[100 * STEP], [-100 * STEP]]
    assert [int(c) - daq_stc.INITIAL_COUNT for c in seen["counter_codes"][:2]] == pytest.approx([-50, 20], abs=1)


def test_linear_scale_of_the_axis_counts_in_both_directions(plant):
    axis = plant("axis")
    assert tick(axis, [5.5e-6], (0,))["counter_codes"][0] == daq_stc.INITIAL_COUNT + 5
    assert tick(axis, [-2.5e-6], (0,))["counter_codes"][0] == daq_stc.INITIAL_COUNT - 3


@pytest.mark.parametrize("kind", ["ivu", "ldu", "axis"])
@pytest.mark.parametrize(
    ("mode", "change", "words"),
    [
        ("fused", {"plant.fmu": ANY}, "lockstep only"),
        ("real", {"plant.fmu": ANY}, "lockstep only"),
        ("lockstep", {"driver.kind": "comedi"}, "a real board keeps real time"),
        ("lockstep", {"driver.kind": "comedi", "plant.fmu": ANY}, "a machine is real or a model"),
    ],
)
def test_plant_that_does_not_support_the_loop_mode_is_refused(config, kind, mode, change, words):
    with pytest.raises((ValueError, UserError), match=words):
        check_plant(config(kind, mode=mode, set=change))
