"""Law of a case of format 2, against recordings of the emulated belt axis under PD control."""

import numpy as np
import pytest
from law_cases import belt, bundle, law

from rtctl.case.laws import INPUT
from rtctl.config.errors import UserError
from rtctl.diagnose.answer.freerun import compare
from rtctl.diagnose.model.loop_of import loop_of
from rtctl.diagnose.model.owner_law import law_agreement, recomputed

STEP = 20.0 / 2**16  # V, step of the emulated converter


def open_loop_warning(record):
    """Warning that the recorded command is the input; "" without a warning."""
    return next((warning for warning in record.case.warnings if INPUT in warning), "")


def test_recorded_command_is_recomputed_within_a_converter_step():
    record = bundle(law())
    assert open_loop_warning(record) == ""
    assert np.abs(recomputed(record, record.case.controller) - record.u[:, 0]).max() <= 0.51 * STEP
    assert np.ptp(record.u) > 1.0
    around = loop_of(record)
    assert (around.known, around.sensor, around.unit, around.limit) == (True, "encoder", "rad", 10.0)


def test_wrong_derivative_gain_is_detected():
    record = bundle(law(D=0.5 * law()["D"]))
    assert record.case.controller is None and not loop_of(record).known
    assert "belt: the law 'pd' does not give the recorded command (off by" in open_loop_warning(record)


def test_gains_and_reference_in_column_units_are_converted():
    scale = belt()[0].machine.sensors["encoder"].scale
    said = law(P=law()["P"] / scale, D=law()["D"] / scale, units="column")
    record, plain = bundle(said, ref=scale * np.array(belt()[1]["ref"])), bundle(law())
    assert open_loop_warning(record) == ""
    np.testing.assert_allclose(record.ref, plain.ref, atol=1e-12)
    again, wanted = (recomputed(r, r.case.controller) for r in (record, plain))
    np.testing.assert_allclose(again, wanted, atol=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_sections_and_cascade_laws_of_format_1_are_recomputed(sign):
    config, rows = belt()
    scale = config.machine.sensors["encoder"].scale
    x, dt = np.array(rows["encoder_counts"]) / scale, 1.0 / config.loop.rate
    e = np.array(rows["ref"]) - x
    late = np.concatenate([[0.0], e[:-1]])
    u = np.clip(sign * (2.0 * e - 1.5 * late), -10.0, 10.0)
    said = {"kind": "lead", "sections": [[sign * 2.0, sign * -1.5, 0.0, 0.0, 0.0]], "sensor": "encoder"}
    record = bundle(said, u=u)
    assert law_agreement(record, record.case.controller).exact
    mean = 0.5 * (x + np.concatenate([x[:1], x[:-1]]))
    v = np.diff(mean, prepend=mean[0]) / dt
    u = np.clip(sign * (20.0 * 0.1 * e - 0.1 * v), -10.0, 10.0)
    record = bundle({"kind": "cascade_p_v", "kp": 20.0, "kv": sign * 0.1, "sensor": "encoder"}, u=u)
    assert law_agreement(record, record.case.controller).exact


def test_free_run_closes_the_loop_with_the_law_of_the_case():
    record = bundle(law())
    result = compare(record)
    assert result.closed
    assert result.channels["encoder"].nrmse < 0.02 and result.channels["amplifier"].nrmse < 0.1


def test_law_may_use_an_untracked_sensor_with_an_offset():
    config, rows = belt()
    scale = config.machine.sensors["scale"].scale
    x = np.array(rows["scale_counts"]) / scale
    ref = np.array(rows["ref"]) * config.machine.joints["belt"].ratio
    u = np.clip(100.0 * (ref - x), -10.0, 10.0)
    away = {"ref": ref + 0.5, "scale_counts": np.array(rows["scale_counts"]) + 0.5 * scale, "u": u}
    said = {"kind": "pd", "P": 100.0, "D": 0.0, "sensor": "scale"}
    runs = [compare(bundle(said, **columns)) for columns in ({"ref": ref, "u": u}, away)]
    one, two = (run.channels["amplifier"].simulated for run in runs)
    assert all(run.closed for run in runs)
    assert np.abs(one - two).max() < 0.02 * np.ptp(one)


def test_recording_without_a_reference_stays_in_open_loop():
    record = bundle(law(), ref=None)
    assert "cannot be recomputed from this recording, which has no reference in every row" in open_loop_warning(record)
    with pytest.raises(UserError, match=r"the loop cannot be closed: belt: the law 'pd' cannot be recomputed"):
        compare(record, closed=True)


def test_drive_outside_the_law_must_have_a_constant_command():
    brake = {"brake": {"body": "carriage", "column": "b", "kind": "force", "unit": "N"}}
    n = len(belt()[1]["t"])
    held = bundle(law(drive="amplifier"), brake, b=np.full(n, 0.25))
    assert open_loop_warning(held) == "" and list(loop_of(held).beside) == [0.0, 0.25]
    moved = bundle(law(drive="amplifier"), brake, b=np.linspace(0.0, 1.0, n))
    assert "it commands amplifier, and the command of brake changes as well" in open_loop_warning(moved)
    assert moved.case.controller is None
