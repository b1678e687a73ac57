import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from known_cases import case_of

from rtctl.case.format1 import read_case
from rtctl.config.errors import NoAnswer, UserError
from rtctl.diagnose.record.format1 import check, law_agreement, load_record, recompute_law
from rtctl.trace.bundle import load_case, save_case


@pytest.fixture
def columns_of():
    """`columns_of("ivu", n, rate)`: columns of a reciprocating machine, with commands of both signs."""

    def make(plant, n=2000, rate=500.0, sweep=2.0):
        rng = np.random.default_rng(3)
        t = np.arange(n) / rate
        swing = sweep * np.sin(2 * np.pi * 0.5 * t)
        w = 0.3 * rng.standard_normal(n)
        if plant == "ivu":
            turn = 2 * np.pi
            counts = np.round(swing / turn * 10000)
            path = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(swing))))) * 0.0125 / turn * 209
            return {
                "t": t, "ref": swing + 0.01, "w": w, "u1": np.cos(t), "u2": np.sin(t), "capstan_counts": counts,
                "reel1_counts": np.floor(path / 0.038), "reel2_counts": np.floor(path / 0.022),
            }  # fmt: skip
        if plant == "ldu":
            counts = np.round(swing * 20000)
            scale = np.round(swing * 2 * np.pi * 0.003 / 5e-7)
            x = counts * 2 * np.pi * 0.003 / 20000
            return {"t": t, "ref": x + 1e-4, "w": w, "u": np.cos(t), "encoder_counts": counts, "scale_counts": scale}
        x = 0.05 * swing
        return {"t": t, "ref": x + 1e-5, "w": 0 * w, "u": np.cos(t) + 0.01 * w, "x": x}

    return make


@pytest.fixture
def bundle_of(tmp_path):
    """`bundle_of(columns, case)` writes a bundle and returns its folder."""

    def write(columns, case, name="bundle"):
        folder = tmp_path / name
        folder.mkdir()
        pq.write_table(pa.table(columns), folder / "recording.parquet")
        save_case(folder, case)
        return folder

    return write


def law_in_force(folder):
    """Replace the commands of the bundle by the output of the law of the case."""
    record = load_record(folder)
    u = recompute_law(record)
    columns = {**record.columns, **{name: u[:, d] for d, name in enumerate(record.commands)}}
    pq.write_table(pa.table(columns), folder / "recording.parquet")
    return load_record(folder)


RATES = {"ivu": 500.0, "ldu": 1000.0, "axis": 1000.0}


@pytest.fixture
def bundle_of_kind(bundle_of, columns_of):
    def make(kind, **changes):
        return bundle_of(columns_of(kind, 3000, RATES[kind]), case_of(kind, **changes), kind + str(len(changes)))

    return make


@pytest.mark.parametrize("kind", ["ivu", "ldu", "axis"])
def test_bundle_with_a_recomputed_law_is_in_closed_loop(bundle_of_kind, kind):
    record = law_in_force(bundle_of_kind(kind))
    assert record.closed_loop
    assert law_agreement(record).exact
    assert record.u.shape == (3000, 2 if kind == "ivu" else 1)
    assert record.dt == 1 / RATES[kind]
    assert record.y


@pytest.mark.parametrize("allocation", ["pull", "differential", "motor1", "motor2"])
def test_law_of_the_two_reel_unit_matches_a_row_by_row_calculation(bundle_of_kind, allocation):
    folder = bundle_of_kind("ivu", controller__allocation=allocation, controller__friction_Nm=0.0024)
    record = load_record(folder)
    u, again = recompute_law(record), []
    c = record.columns
    d = e_prev = ref_prev = None
    a = 1 - np.exp(-2 * np.pi * 80.0 / 500.0)
    for k in range(len(record.t)):
        e = c["ref"][k] - 2 * np.pi * c["capstan_counts"][k] / 10000
        step = 0.0 if k == 0 else np.sign(c["ref"][k] - ref_prev)
        d = 0.0 if k == 0 else d + a * ((e - e_prev) * 500.0 - d)
        e_prev, ref_prev = e, c["ref"][k]
        uc = 6.2 * e + 1.0 * d + 0.0024 * step / (0.06 * 0.2) + c["w"][k]
        T1, T2 = 0.1 * 0.038 / (0.06 * 0.2), 0.1 * 0.022 / (0.05 * 0.2)
        again.append(
            {
                "pull": (T1 + max(uc, 0), T2 + max(-uc, 0)),
                "differential": (T1 + uc / 2, T2 - uc / 2),
                "motor1": (T1 + uc, T2),
                "motor2": (T1, T2 - uc),
            }[allocation]
        )
    assert np.abs(u - np.clip(again, -10, 10)).max() <= 0.5 * 20 / 4096 + 1e-9
    assert np.all(u / (20 / 4096) == np.round(u / (20 / 4096)))


def test_voltage_between_two_converter_steps_is_rounded_up(bundle_of_kind):
    folder = bundle_of_kind("ldu", controller__sections=[[0.0, 0.0, 0.0, 0.0, 0.0]])
    record = load_record(folder)
    step = 20 / 4096
    w = np.array([0.5, -0.5, 1.5, -1.5, 700.0, -700.0]) * step
    u = recompute_law(record._replace(w=np.resize(w, 3000)))
    assert (u[:6, 0] / step).tolist() == [1, 0, 2, -1, 614, -614]


def test_law_that_does_not_reproduce_the_command_is_dropped(bundle_of_kind):
    record = load_record(bundle_of_kind("ldu"))
    assert not record.case.controller_known
    assert not record.closed_loop
    assert "row" in record.case.warnings[-1]
    assert "lead_lag" in record.case.warnings[-1]


def test_deviation_in_the_first_row_keeps_the_law(bundle_of_kind):
    folder = bundle_of_kind("axis")
    record = law_in_force(folder)
    columns = dict(record.columns)
    columns["u"] = columns["u"].copy()
    columns["u"][0] += 0.5
    pq.write_table(pa.table(columns), folder / "recording.parquet")
    again = load_record(folder)
    assert again.closed_loop
    assert not law_agreement(again).exact
    assert law_agreement(again).worst_row == 0


def test_unknown_reference_is_allowed_only_with_an_unknown_law(bundle_of, columns_of):
    columns = {**columns_of("axis", 3000, 1000.0), "ref": np.full(3000, np.nan)}
    case = case_of("axis", controller={"kind": "unknown"}, controller_known=False)
    record = load_record(bundle_of(columns, case))
    assert np.isnan(record.ref).all()
    assert not record.closed_loop
    with pytest.raises(UserError, match="column 'ref', row 0 and 2999 more rows: nan; it should be a finite number"):
        load_record(bundle_of(columns, case_of("axis"), "known"))


def test_open_loop_case_uses_the_recorded_command(bundle_of, columns_of):
    record = load_record(bundle_of(columns_of("axis", 3000, 1000.0), case_of("axis", controller={"kind": "none"})))
    assert recompute_law(record) is None
    assert not record.closed_loop
    assert record.case.warnings == ()


def change(name, row, value):
    def edit(columns):
        columns[name] = columns[name].astype(float)
        columns[name][row] = value

    return edit


def rename(old, new):
    return lambda columns: columns.__setitem__(new, columns.pop(old))


@pytest.mark.parametrize(
    ("kind", "edit", "said"),
    [
        ("ivu", rename("u2", "u_2"), "has no column 'u2' .V, written at this tick.; is it 'u_2'"),
        (
            "ivu",
            rename("capstan_counts", "capstan_count"),
            "'capstan_counts' .counts.; is it 'capstan_count'",
        ),
        ("ivu", rename("reel1_counts", "zzz"), "no column 'reel1_counts'"),
        ("ldu", rename("encoder_counts", "encoder_count"), "no column 'encoder_counts'.*is it 'encoder_count'"),
        ("ldu", rename("w", "excitation"), "no column 'w'"),
        ("axis", rename("ref", "reff"), "no column 'ref' .position reference.; is it 'reff'"),
        ("axis", rename("x", "y"), "no column 'x' .m, measured position. and no column 'speed'"),
        ("axis", rename("t", "time"), "no column 't'"),
        ("ivu", change("u1", 17, np.nan), "column 'u1', row 17: nan; it should be a finite number"),
        ("ldu", change("scale_counts", 8, np.inf), "column 'scale_counts', row 8: inf; it should be a finite number"),
        ("ldu", change("encoder_counts", 40, 1.5), "column 'encoder_counts', row 40: 1.5 is not a whole number"),
        ("axis", change("t", 100, 0.05), "column 't', row 100: 0.05 s after 0.099 s; time should increase"),
        ("axis", change("t", 5, np.nan), "column 't' is not finite in row 5"),
        ("axis", lambda c: c.__setitem__("t", c["t"] * 1.02), "980.392 rows a second where sample_rate .* is 1000 Hz"),
    ],
)
def test_invalid_columns_are_refused_with_a_correction(bundle_of, columns_of, kind, edit, said):
    columns = columns_of(kind, 3000, RATES[kind])
    edit(columns)
    with pytest.raises(UserError, match=said) as error:
        load_record(bundle_of(columns, case_of(kind)))
    assert "recording.parquet" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("kind", "edit", "said"),
    [
        ("axis", lambda c: c.__setitem__("u", np.full(3000, 0.3)), "'u' never changes"),
        ("ivu", lambda c: c.update(u1=np.zeros(3000), u2=np.zeros(3000)), "'u1' and 'u2' never changes"),
        ("ivu", lambda c: c.__setitem__("capstan_counts", np.zeros(3000)), "'capstan_counts' never changes"),
        ("axis", lambda c: c.__setitem__("x", np.zeros(3000)), "'x' never changes"),
        ("axis", lambda c: c.update({k: v[:1900] for k, v in c.items()}), "lasts 1.9 s; it supports no verdict"),
        ("axis", lambda c: c.update({k: v[:400] for k, v in c.items()}), "holds 400 rows; it supports no verdict"),
        ("axis", lambda c: c.update({k: v[:1] for k, v in c.items()}), "holds 1 rows"),
    ],
)
def test_record_without_motion_or_length_has_no_answer(bundle_of, columns_of, kind, edit, said):
    columns = columns_of(kind, 3000, RATES[kind])
    edit(columns)
    with pytest.raises(NoAnswer, match=said):
        load_record(bundle_of(columns, case_of(kind)))


def test_missing_sensor_resolutions_are_refused(bundle_of, columns_of):
    columns = columns_of("ldu", 3000, 1000.0)
    with pytest.raises(UserError, match=r"case\.json: sensors\.scale_m_per_count is missing"):
        load_record(bundle_of(columns, case_of("ldu", sensors__scale_m_per_count=None)))
    with pytest.raises(UserError, match=r"case\.json: sensors\.encoder_counts_per_rev is missing"):
        load_record(bundle_of(columns, case_of("ldu", sensors__encoder_counts_per_rev=None), "b"))


def test_one_drive_or_one_reel_may_be_at_rest(bundle_of, columns_of):
    columns = {**columns_of("ivu", 3000), "u2": np.full(3000, 0.4), "reel1_counts": np.zeros(3000)}
    record = load_record(bundle_of(columns, case_of("ivu")))
    assert any("reel1_counts" in text for text in record.case.warnings)


def test_record_unwraps_the_counters(bundle_of, columns_of):
    columns = columns_of("ldu", 3000, 1000.0)
    true = columns["encoder_counts"]
    columns["encoder_counts"] = true % 65536
    record = load_record(bundle_of(columns, case_of("ldu")))
    assert np.array_equal(np.diff(record.y["encoder_counts"]), np.diff(true))
    assert np.array_equal(record.columns["encoder_counts"], true % 65536)


def test_angle_with_a_jump_per_turn_is_unwrapped(bundle_of, columns_of):
    columns = columns_of("axis", 3000, 1000.0)
    true = np.linspace(0.1, 30.0, 3000)
    columns["x"] = true % (2 * np.pi)
    record = load_record(bundle_of(columns, case_of("axis", sensors__unit="rad")))
    assert np.allclose(record.y["x"], true)


@pytest.mark.parametrize("name", [f"case-{k:04d}" for k in range(1, 25)])
def test_law_of_practice_cases_reproduces_the_commands_bit_for_bit(shared, name):
    record = load_record(shared(f"blind/practice/{name}"))
    assert np.array_equal(recompute_law(record), record.u)
    assert record.closed_loop
    assert record.case.warnings == ()


def test_law_of_the_ball_screw_reproduces_the_command_approximately(shared):
    record = load_record(shared("data/emps"))
    agreement = law_agreement(record)
    assert record.closed_loop
    assert not agreement.exact
    assert agreement.worst_row == 0  # the record has no speed before the first row
    assert agreement.median < 1e-4
    assert record.case.warnings == ()


@pytest.mark.parametrize("name", ["silverbox_multisine", "bldc_slow_0", "bldc_slow_1", "bldc_slow_2"])
def test_real_machines_without_a_law_are_in_open_loop(shared, name):
    folder = shared(f"data/{name}")
    table = pq.read_table(folder / "recording.parquet")
    columns = {key: table.column(key).to_numpy() for key in table.column_names}
    record = check(columns, read_case(load_case(folder), folder), folder)
    assert not record.closed_loop
    assert record.case.warnings == ()
    assert set(record.y) == {"x"}
    assert np.isnan(record.ref).all() == name.startswith("bldc")


def test_case_with_another_sample_rate_is_refused(shared, tmp_path):
    folder = shutil.copytree(shared("blind/practice/case-0001"), tmp_path / "copy")
    text = (folder / "case.json").read_text()
    (folder / "case.json").write_text(text.replace('"sample_rate": 500.0', '"sample_rate": 400.0'))
    with pytest.raises(UserError, match=r"500 rows a second where sample_rate in case\.json is 400 Hz"):
        load_record(folder)


def test_rows_at_uneven_times_are_resampled_to_an_even_clock(bundle_of, columns_of):
    t = np.cumsum(np.random.default_rng(2).uniform(0.8e-3, 1.2e-3, 4000))
    columns = {**columns_of("axis", 4000, 1000.0), "t": t, "x": np.sin(3 * t), "u": np.cos(2 * t)}
    columns["ref"] = np.full(4000, np.nan)
    case = case_of("axis", sample_rate=None, controller={"kind": "unknown"}, controller_known=False)
    record = load_record(bundle_of(columns, case))
    assert np.diff(record.t) == pytest.approx(record.dt, rel=1e-9)
    assert record.dt == pytest.approx(np.median(np.diff(t)))
    assert (record.t[0], record.t[-1]) == pytest.approx((t[0], t[-1]), abs=record.dt)
    assert len(record.u) == len(record.ref) == len(record.w) == len(record.y["x"]) == len(record.t)
    assert record.y["x"] == pytest.approx(np.sin(3 * record.t), abs=1e-5)
    assert record.u[:, 0] == pytest.approx(np.cos(2 * record.t), abs=1e-5)
    assert np.isnan(record.ref).all()
    assert (record.columns["t"] == t).all()


def test_resampled_counters_stay_integers(bundle_of, columns_of):
    t = np.cumsum(np.random.default_rng(2).uniform(0.8e-3, 1.2e-3, 4000))
    case = case_of("ldu", sample_rate=None, controller={"kind": "unknown"}, controller_known=False)
    record = load_record(bundle_of({**columns_of("ldu", 4000, 1000.0), "t": t}, case))
    counts = record.y["encoder_counts"]
    assert (counts == np.round(counts)).all()
