"""Settings of the improved config."""

from rtctl.improve.remedy import written

EFFECTS = [{"term": "a"}, {"term": "b"}, {"term": "c"}]


def test_config_omits_compensations_of_size_zero():
    values = {
        "law.compensation.feedforward.lead": 1e-3,
        "law.compensation.feedforward.effects.2.share": 0.9,
        "law.compensation.feedforward.effects.0.share": 0.0,
        "law.compensation.integral.gain": 3.0,
        "law.friction.F_c": 0.0,
    }
    assert written(values, EFFECTS) == {
        "law.friction.F_c": 0.0,
        "law.compensation": {
            "feedforward": {
                "lead": 1e-3, "inertia": 0.0, "friction": 0.0, "viscous": 0.0, "velocity": 0.0,
                "effects": [{"effect": {"term": "c"}, "share": 0.9}],
            },
            "integral": {"gain": 3.0},
        },
    }  # fmt: skip


def test_no_values_give_an_empty_config_change():
    assert written({}, EFFECTS) == {}
