"""Free runs of models against recordings of described machines."""

from functools import cache

import numpy as np
import pytest
import yaml
from graph_cases import BELT, RUB, at_rest, case_of, command, record

from rtctl.cli.common import load_config
from rtctl.config.errors import UserError
from rtctl.config.load import set_path
from rtctl.diagnose.answer.believe import believing
from rtctl.diagnose.answer.freerun import compare
from rtctl.loop import fused

SECONDS = 2.0


@cache
def recording_with_extra_friction():
    """Recording of a belt axis with extra dry friction of the carriage."""
    return record(case_of(BELT, problem="driven"), command(6.0), terms=[RUB])


@pytest.fixture
def model(tmp_path):
    """Model file of the machine with the extra dry friction."""
    path = tmp_path / "model.yaml"
    path.write_text(yaml.safe_dump({"machine": BELT, "plant": {"physics": [RUB]}}))
    return path


def test_model_with_the_missing_effect_reduces_the_free_run_error(model):
    before, after = compare(recording_with_extra_friction()), compare(believing(recording_with_extra_friction(), model))
    assert not before.closed and before.skipped == after.skipped > 0
    assert set(after.channels) == {"encoder", "scale"}
    assert after.channels["scale"].unit == "m" and after.channels["encoder"].unit == "rad"
    for name, channel in after.channels.items():
        assert channel.nrmse < 0.02 < 0.2 * before.channels[name].nrmse


def test_skipped_rows_are_tracked_before_the_free_run(model):
    whole = compare(believing(recording_with_extra_friction(), model), skip=1000)
    assert whole.skipped == 1000 and len(whole.t) == len(recording_with_extra_friction().t) - 1000
    assert whole.channels["encoder"].recorded[0] == recording_with_extra_friction().y["encoder"][1000]


@pytest.mark.parametrize(
    ("words", "message"), [({"closed": True}, "its law is not known"), ({"skip": 10**6}, "--skip")]
)
def test_closed_loop_without_a_law_and_excessive_skip_are_refused(words, message):
    with pytest.raises(UserError, match=message):
        compare(recording_with_extra_friction(), **words)


def test_model_of_another_machine_is_refused(tmp_path):
    other = tmp_path / "other.yaml"
    other.write_text(yaml.safe_dump({**BELT, "bodies": {**BELT["bodies"], "wheel": {"inertia": 1e-5}}}))
    with pytest.raises(UserError, match="wheel"):
        believing(recording_with_extra_friction(), other)


def test_free_run_closes_the_loop_with_the_recorded_law():
    config = set_path(load_config("machines/belt", []), "loop.mode", "fused")
    rows = fused.run(config, SECONDS + 0.5).between(0.0, SECONDS)
    empty = at_rest(config, SECONDS)
    sensors = empty.case.machine.sensors
    y = {name: (rows[s.column] + 0.5) / s.scale for name, s in sensors.items()}
    recorded = empty._replace(ref=np.array(rows["ref"]), w=np.array(rows["w"]), u=rows["u"][:, None], y=y)
    found = compare(recorded)
    assert found.closed and set(found.channels) == {"encoder", "scale", "amplifier"}
    assert found.channels["amplifier"].unit == "V"
    assert all(channel.nrmse < 0.02 for channel in found.channels.values())
