import numpy as np
import pytest
from law_cases import belt, bundle, law

from rtctl import machines
from rtctl.diagnose.answer.config import to_config
from rtctl.diagnose.answer.played_law import played_law
from rtctl.diagnose.model.model import nominal


def settings(record):
    """Validated settings of the law of a record, in a config of its machine."""
    data = {**to_config(nominal(record.case), record), "law": played_law(record)}
    return machines.class_of(data).model_validate(data).law


def test_law_of_the_case_becomes_the_law_of_the_config():
    made, wanted = settings(bundle(law())), belt()[0].law
    assert (made.feedback, made.drive) == ("encoder", "amplifier")
    assert made.position.gain == pytest.approx(wanted.position.gain)
    assert made.position.tau_d == pytest.approx(wanted.position.tau_d)
    assert made.position.derivative_filter == pytest.approx(wanted.position.derivative_filter)


def test_sections_and_cascade_laws_are_translated():
    rows = belt()[1]
    x = np.array(rows["encoder_counts"]) / belt()[0].machine.sensors["encoder"].scale
    e = np.array(rows["ref"]) - x
    said = {"kind": "sections", "sections": [[2.0, 0.0, 0.0, 0.0, 0.0]], "sensor": "encoder"}
    assert settings(bundle(said, u=np.clip(2.0 * e, -10.0, 10.0))).position.sections[0].b0 == 2.0
    mean = 0.5 * (x + np.concatenate([x[:1], x[:-1]]))
    u = 2.0 * e - 0.1 * np.diff(mean, prepend=mean[0]) * belt()[0].loop.rate
    said = {"kind": "cascade_p_v", "kp": 20.0, "kv": 0.1, "sensor": "encoder"}
    found = settings(bundle(said, u=np.clip(u, -10.0, 10.0))).position
    assert (found.kind, found.gain, found.velocity_gain) == ("pi_velocity", 2.0, 0.1)


def test_law_with_negative_gain_is_replaced_by_a_stand_in():
    e = np.array(belt()[1]["ref"]) - np.array(belt()[1]["encoder_counts"]) / belt()[0].machine.sensors["encoder"].scale
    record = bundle({"kind": "pd", "P": -1.0, "D": 0.0, "sensor": "encoder"}, u=np.clip(-e, -10.0, 10.0))
    assert record.case.controller is not None
    assert "shares" in played_law(record)  # the stand-in


def test_unknown_law_is_replaced_by_a_stand_in():
    assert "shares" in played_law(bundle({"kind": "unknown"}))
