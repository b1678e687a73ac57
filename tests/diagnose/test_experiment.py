import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.cli.common import load_config
from rtctl.config.errors import NoAnswer
from rtctl.diagnose import experiment
from rtctl.diagnose.case import read_case
from rtctl.diagnose.experiment import design, limits_of
from rtctl.diagnose.kernel import CLOSED
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.motions import MENU, Limits
from rtctl.diagnose.quantities import quantities
from rtctl.diagnose.record import Record
from rtctl.diagnose.simulate import Simulator
from rtctl.laws import reference
from rtctl.plants.physics import TERMS

AXIS = {
    "plant": "axis",
    "sample_rate": 1000.0,
    "parameters": {"M": 95.0, "F_v": 200.0, "F_c": 20.0},
    "drive": {"newton_per_volt": 35.0, "limit_volt": 10.0},
    "controller": {"kind": "cascade_p_v", "kp": 160.0, "kv": 243.0},
}
IVU = {
    "plant": "ivu",
    "sample_rate": 500.0,
    "sensors": {"capstan_counts_per_rev": 10000, "reel_counts_per_rev": 209},
    "drive": {"amp_per_volt": [0.2, 0.2], "limit_volt": 10.0, "dac_bits": 12},
    "controller": {"kind": "pd", "P": 6.2, "D": 1.0, "derivative_filter_hz": 80.0, "tension_N": 0.1},
}


@pytest.fixture(scope="module")
def recorded():
    """`recorded(case, **changes)`: what the owner's own model does under its law, to and fro over a smooth way."""

    def make(case, n=4000, **changes):
        read = read_case({**case, **changes}, ".")
        dt = 1 / read.sample_rate
        t = np.arange(n) * dt
        way = 4.0 if read.plant == "ivu" else 0.05
        ref = way * (1 - np.cos(2 * np.pi * t / 2.0)) - 0.25 * way * np.sin(t)
        names = {"ivu": ("capstan_counts", "reel1_counts", "reel2_counts")}.get(read.plant, ("x",))
        blank = np.zeros((n, 1 + (read.plant == "ivu")))
        empty = Record(read.plant, read, t, dt, ref, np.zeros(n), blank, dict.fromkeys(names, np.zeros(n)), {})
        out, volts, _ = Simulator(empty, lead=0).everything(owner_model(read), CLOSED)
        y = {name: np.floor(out[:, i]) if read.plant == "ivu" else out[:, i] for i, name in enumerate(names)}
        if read.plant == "axis":
            y = {"x": np.round(y["x"] / 1e-6) * 1e-6}
        return empty._replace(u=volts, y=y)

    return make


@pytest.fixture(scope="module")
def rivals():
    """`rivals(record, ("friction.coulomb", {...}), ...)`: the owner's model with each of these terms."""

    def make(record, *terms):
        owner = owner_model(record.case)
        return [owner.add(TERMS[n].settings.model_validate({"term": n, **values})) for n, values in terms]

    return make


@pytest.fixture(scope="module")
def dry_or_viscous(recorded, rivals):
    """A record and two rivals that agree at its mean speed."""
    record = recorded(AXIS)
    dry, viscous = {"node": "carriage", "F_C": 6.0}, {"node": "carriage", "B": 50.0}
    return record, rivals(record, ("friction.coulomb", dry), ("friction.viscous", viscous))


def test_coulomb_against_viscous_is_told_apart_at_several_speeds(dry_or_viscous):
    found = design(*dry_or_viscous)
    assert found.name == "constant_speeds"
    assert found.rivals == ("friction.coulomb:carriage", "friction.viscous:carriage")
    assert found.distance["constant_speeds"] >= 0.9 * max(found.distance.values()) > 3 * experiment.LEAST
    assert found.distance["whole_travel"] < found.distance["constant_speeds"]  # one speed says little
    assert found.words.startswith("Move at three constant speeds")


def test_an_offset_against_friction_that_depends_on_the_direction(recorded, rivals):
    record = recorded(AXIS)
    offset, asymmetry = (
        ("drive.offset", {"node": "drive", "offset": 0.2}),
        ("friction.asymmetry", {"node": "carriage", "a": 0.3}),
    )
    found = design(record, rivals(record, offset, asymmetry))
    assert found.name == "small_reversals"  # both push alike wherever it moves; at rest the offset alone does


def test_what_warms_up_is_seen_by_working_hard(recorded, rivals):
    record = recorded(AXIS)
    drift = ("drive.thermal", {"node": "drive", "a": -0.2, "tau": 15.0, "V_ref": 2.0})
    found = design(record, rivals(record, drift, ("friction.viscous", {"node": "carriage", "B": 50.0})))
    assert found.name == "warm_up"


def test_equal_rivals_are_no_distance_apart(dry_or_viscous):
    record, (one, _) = dry_or_viscous
    found = design(record, [one, one])
    assert found.distance[found.name] == pytest.approx(0.0, abs=1e-9)
    assert found.rivals == ("friction.coulomb:carriage (1)", "friction.coulomb:carriage (2)")


def test_of_three_rivals_a_pair_that_nothing_tells_apart_does_not_count(dry_or_viscous):
    record, (dry, viscous) = dry_or_viscous
    found = design(record, [dry, viscous, dry])
    assert found.name == "constant_speeds"
    assert found.distance[found.name] > experiment.LEAST


def test_one_rival_is_refused(dry_or_viscous):
    record, models = dry_or_viscous
    with pytest.raises(ValueError, match="at least two"):
        design(record, models[:1])


def test_the_command_stays_within_the_drives_limit(recorded, rivals):
    record = recorded(AXIS)
    models = rivals(
        record,
        ("friction.coulomb", {"node": "carriage", "F_C": 6.0}),
        ("friction.viscous", {"node": "carriage", "B": 50.0}),
    )
    tight = record._replace(case=record.case._replace(drive=record.case.drive.model_copy(update={"limit_volt": 2.5})))
    wide, narrow = design(record, models), design(tight, models)
    assert narrow.limits.command == pytest.approx(0.95 * 2.5)
    sim = experiment.prepared(Simulator(tight), narrow.motion, models[0])
    for model in models:
        assert np.abs(sim.everything(model, CLOSED)[1]).max() <= narrow.limits.command
    assert np.abs(np.diff(narrow.motion.knots[:, 1])).sum() <= np.abs(np.diff(wide.motion.knots[:, 1])).sum()
    none = record._replace(case=record.case._replace(drive=record.case.drive.model_copy(update={"limit_volt": 0.01})))
    with pytest.raises(NoAnswer, match="no motion stays within the limits"):
        design(none, models)


def test_without_the_law_the_rivals_are_kept_on_the_motion(dry_or_viscous):
    record, models = dry_or_viscous
    unknown = record._replace(case=record.case._replace(controller_known=False))
    found = design(unknown, models)
    assert found.distance[found.name] > experiment.LEAST
    assert found.limits.low <= found.motion.knots[:, 1].min()


def test_limits_are_those_of_the_recording(recorded):
    record = recorded(AXIS)
    limits = limits_of(Simulator(record))
    assert limits.low == record.y["x"].min() and limits.high == record.y["x"].max()
    assert 0.1 < limits.speed < 0.2  # 0.05 m x pi rad/s, and a little more
    assert limits.command == 9.5


@settings(deadline=None, max_examples=60)
@given(
    plant=st.sampled_from(["ivu", "ldu", "axis"]), low=st.floats(-10, 0), span=st.floats(1e-3, 50),
    speed=st.floats(1e-3, 20), stiff=st.floats(2, 200), ease=st.sampled_from([1.0, 0.35]),
)  # fmt: skip
def test_every_motion_stays_within_travel_and_speed(plant, low, span, speed, stiff, ease):
    low = max(low, -span)
    dt = {"ivu": 2e-3, "ldu": 1e-4, "axis": 1e-3}[plant]
    limits = Limits("m", "V", dt, low, low + span, speed, stiff * speed, 1e-4 * span, 10.0)
    for make in MENU:
        motion = make(limits, ease)
        t, r = motion.knots.T
        assert len(t) <= reference.MOST
        assert t[0] == 0.0 and r[0] == 0.0 and (np.diff(t) > 0).all()
        assert limits.low - 1e-9 <= r.min() and r.max() <= limits.high + 1e-9, motion.name
        assert np.abs(np.diff(r) / np.diff(t)).max() <= 1.001 * speed, motion.name
        assert motion.repeat is None or motion.repeat >= t[-1] - 1e-9
        assert motion.words.endswith(".")


def test_rivals_are_called_by_what_they_differ_in():
    rivals = ("friction.stribeck:carriage + drive.lag:drive", "friction.stribeck:carriage + timing.delay:loop")
    assert experiment.called(rivals, quantities(None)) == ["a lag at the drive", "extra delay at the loop"]
    assert experiment.called(("drive.lag:drive", "nothing"), quantities(None)) == ["a lag at the drive", "nothing"]
    more = ("drive.lag:drive + drive.offset:drive", "drive.lag:drive")
    assert experiment.called(more, quantities(None))[1] == "no more"
    numbered = ("drive.lag:drive (1)", "drive.lag:drive (2)")
    assert len(set(experiment.called(numbered, quantities(None)))) == 2


def test_what_it_is_for_is_said_in_words(dry_or_viscous):
    why = design(*dry_or_viscous).why
    assert why.startswith("It tells dry friction at the carriage from viscous friction at the carriage: ")
    assert why.endswith(" times the noise apart.")


def test_what_goes_into_the_diagnosis(dry_or_viscous):
    record, models = dry_or_viscous
    said = design(record, models).as_dict()
    assert said["name"] == "constant_speeds"
    assert set(said["why"]["distance"]) | set(said["why"]["refused"]) == {
        m(limits_of(Simulator(record)), 1.0).name for m in MENU
    }
    assert said["reference"]["unit"] == "m" and said["reference"]["knots"][0] == [0.0, 0.0]
    assert said["limits"]["travel"][0] < 0 < said["limits"]["travel"][1]


def test_a_reel_unit(recorded, rivals):
    record = recorded(IVU)
    models = rivals(
        record,
        ("friction.coulomb", {"node": "motor1", "F_C": 3e-4}),
        ("drive.offset", {"node": "drive1", "offset": 0.02}),
    )
    found = design(record, models)
    assert found.limits.unit == "rad"
    assert found.distance[found.name] > 0.1
    config = load_config("ivu", [])
    assert type(config).model_fields["reference"].annotation is reference.ReferenceSettings
