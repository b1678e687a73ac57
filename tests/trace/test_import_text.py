"""Import of text: layout of names and rows, decimal signs, dates, units in names and in rows, encodings, options."""

import gzip
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from rtctl.cli.main import main
from rtctl.config.errors import UserError
from rtctl.trace.bundle import load_bundle
from rtctl.trace.imports import read
from rtctl.trace.imports.make import make_bundle
from rtctl.trace.imports.plan import ColumnPlan, Plan, with_options
from rtctl.trace.imports.text_form import TextPlan

FAILING = Path("../shared/failing")
needs_failing = pytest.mark.skipif(not FAILING.is_dir(), reason="the recordings that failed are not here")


def columns(tmp_path, content, name="a.csv", **plan):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read(path, TextPlan(**plan))


def values(table):
    return {name: column.tolist() for name, column in table.columns.items()}


TIME_U = {"time": [0, 1, 2], "u": [0.5, 1.5, 2.5]}


@pytest.mark.parametrize(
    "content",
    [
        "# by a logger, 2026\n# time, u\n0,0.5\n1,1.5\n2,2.5\n",
        "#time,u\n0,0.5\n1,1.5\n2,2.5\n# end\n",
        "time u\n0   0.5\n 1\t1.5\n2 2.5\n",
        "% time u\n0.0e0 5.0e-1\n1.0e0 1.5e0\n2e0 2.5e0\n",
        "time|u\n0|0.5\n1|1.5\n2|2.5\n",
        "sep=;\ntime;u\n0;0,5\n1;1,5\n2;2,5\n",
        "\ufeffsep=;\r\ntime;u\r\n0;0,5\r\n1;1,5\r\n2;2,5\r\n",
        "time,u\n0,0.5,\n1,1.5,\n2,2.5,\n",
        "time,u,\n0,0.5,\n1,1.5,\n2,2.5,\n",
        "Model,DPO2024\nPoint Format,Y,\n\nLabel,,\ntime,u\n0,0.5\n1,1.5\n2,2.5\n",
        "time;u\n0;0.5\n1;1.5\n2;2.5\n;\n;\n",
        "time\tu\n+0\t+0.5\n+1\t+1.5\n+2\t+2.5\n",
        'time,u\n"0","0,5"\n"1","1,5"\n"2","2,5"\n',
        "time,u\r0,0.5\r1,1.5\r2,2.5\r",
        "time u\n0 0.5D+00\n1 0.15D+01\n2 0.25d1\n",
    ],
)
def test_lines_of_names_units_and_rows_are_found(tmp_path, content):
    assert values(columns(tmp_path, content)) == TIME_U


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("t;x\n0;0,998\n1;1.000,5\n2;1.001\n", [0.998, 1000.5, 1001]),
        ("t;x\n0;998\n1;1.000\n2;1.001,25\n", [998, 1000, 1001.25]),  # the last line decides
        ("t;x\n0;1.234.567\n1;1.000\n2;7\n", [1234567, 1000, 7]),
        ("t\tx\n0\t1,980\n1\t1,981.5\n2\t12\n", [1980, 1981.5, 12]),
        ("t;x\n0;1 234,5\n1;1'234,5\n2;1\u202f234,5\n", [1234.5, 1234.5, 1234.5]),
        ("t;x\n0;1.000\n1;1.001\n2;0.999\n", [1, 1.001, 0.999]),
        ("t;x\n0;\u22121,5\n1;-1,5\n2;+1,5\n", [-1.5, -1.5, 1.5]),
        ("t;x\n0;1,5e-3\n1;2,5E+2\n2;-3\n", [1.5e-3, 250, -3]),
        ('t,x\n0,"1,980"\n1,"1,981.5"\n2,12\n', [1980, 1981.5, 12]),
    ],
)
def test_one_decimal_sign_holds_for_the_whole_file(tmp_path, content, expected):
    assert values(columns(tmp_path, content))["x"] == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("text", ["1,980", "1.980", "-12,000"])
def test_ambiguous_decimal_sign_needs_an_option(tmp_path, text):
    content = f"t;x\n0;{text}\n1;{text}\n"
    sign = "," if "," in text else "."
    with pytest.raises(UserError, match=rf"a.csv: '{text}' \(line 2\) is .* nothing in the file says .*--decimal"):
        columns(tmp_path, content)
    decimal = columns(tmp_path, content, decimal=sign).columns["x"][0]
    grouped = columns(tmp_path, content, decimal="." if sign == "," else ",").columns["x"][0]
    assert (decimal, grouped) == (float(text.replace(",", ".")), float(text.replace(sign, "")))


def test_contradictory_decimal_signs_are_refused(tmp_path):
    with pytest.raises(UserError, match=r"'0\.5' \(line 3\) has a decimal point and '0,25' \(line 2\) a decimal comma"):
        columns(tmp_path, "t;x\n0;0,25\n1;0.5\n")


@pytest.mark.parametrize(
    ("content", "step"),
    [
        ("time,u\n2026-11-26 10:00:00.000,1\n2026-11-26 10:00:00.001,2\n", 1e-3),
        ("time,u\n2026-11-26T10:00:00,1\n2026-11-26T10:00:01,2\n", 1.0),
        ("time,u\n2026-11-26T10:00:00.000Z,1\n2026-11-26T10:00:00.250Z,2\n", 0.25),
        ("time;u\n2026-11-26 10:00:00,000;1,5\n2026-11-26 10:00:00,002;2,5\n", 2e-3),
        ("time,u\n10:00:00,1\n10:00:02,2\n", 2.0),
        ("time;u\n10:00:00,000;1,5\n10:00:00,250;2,5\n", 0.25),
        ("time;u\n26.11.2026 10:00:00,000;1,5\n26.11.2026 10:00:00,250;2,5\n", 0.25),
        ("time;u\n26.11.2026 10:00:00;1\n26.11.2026 10:00:03;2\n", 3.0),
        ("time;u\n2026-11-26T10:00:00,5Z;1,5\n2026-11-26T10:00:01,0Z;2,5\n", 0.5),
        ("time,u\n1700000000000000000,1\n1700000000000001000,2\n", None),
    ],
)
def test_dates_become_seconds(tmp_path, content, step):
    table = columns(tmp_path, content)
    found = table.times("time", 1.0 if step else 1e-9)
    assert np.diff(found) == pytest.approx([step or 1e-6], rel=1e-12)
    if step:
        with pytest.raises(UserError, match="holds dates or durations; only t can be one"):
            table.numbers("time", "x")


@pytest.mark.parametrize(
    ("content", "units"),
    [
        ("Zeit t / s;Weg x / mm\n0;0,5\n1;1,5\n", {"Zeit t / s": "s", "Weg x / mm": "mm"}),
        ("Time,Channel A\n(ms),(mV)\n\n0,1.5\n1,2.5\n", {"Time": "ms", "Channel A": "mV"}),
        ("x-axis,1\nsecond,Volt\n0,1.5\n1,2.5\n", {"x-axis": "s", "1": "V"}),
        ("t,x [mm],y\n0,1.5,2\n1,2.5,3\n", {"x": "mm"}),
        ("t in ms,x\n0,1.5\n1,2.5\n", {"t in ms": "ms"}),
    ],
)
def test_units_in_a_text_file_are_read(tmp_path, content, units):
    assert columns(tmp_path, content).units == units


@pytest.mark.parametrize(
    ("name", "unit", "ours"),
    [("time_ms", "ms", "t"), ("pos_mm", "mm", "x"), ("u_mV", "mV", "u"), ("angle_deg", "deg", "x")],
)
def test_unit_suffix_of_a_name_must_be_confirmed(tmp_path, name, unit, ours):
    header = ",".join(name if column == ours else column for column in ("t", "u", "x"))
    table = columns(tmp_path, f"{header}\n0,0.5,0\n1,1.5,1\n2,2.5,2\n")
    plan = Plan(plant="axis", columns={c: ColumnPlan(column=name if c == ours else c) for c in "tux"})
    with pytest.raises(UserError, match=rf"column '{name}' \({ours}\) has no unit, .*--unit {ours}={unit} if it is"):
        make_bundle(table, plan, tmp_path / "b")
    assert not (tmp_path / "b").exists()


@pytest.mark.parametrize(
    ("times", "words"),
    [
        (("1700000000000", "1700000000001", "1700000000002"), r"begins at 1.7e\+12 s; --unit t=ns, us, ms"),
        (("46352.41666667", "46352.41666668", "46352.41666669"), r"rows would be 1.*e-08 s apart; .* d \(days\)"),
        (("0", "1000", "2000"), "rows would be 1000 s apart"),
    ],
)
def test_time_that_cannot_be_in_seconds_needs_a_unit(tmp_path, times, words):
    table = columns(tmp_path, "t,u,x\n" + "".join(f"{t},1,2\n" for t in times))
    with pytest.raises(UserError, match=words):
        make_bundle(table, Plan(plant="axis"), tmp_path / "b")
    unit = "d" if "." in times[0] else "ms"
    made = make_bundle(table, Plan(plant="axis", columns={"t": {"unit": unit}}, uneven=True), tmp_path / "b")
    assert made.rows == 3


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-8-sig", "cp1252"])
def test_text_encodings_are_read(tmp_path, encoding):
    text = "time [s];x [\u00b5m]\n0;0,5\n1;1,5\n"
    given = {"encoding": encoding} if encoding == "utf-16-le" else {}
    table = columns(tmp_path, text.encode(encoding), **given)
    assert values(table) == {"time": [0, 1], "x": [0.5, 1.5]} and table.units == {"time": "s", "x": "\u00b5m"}
    if encoding == "utf-16-le":
        with pytest.raises(UserError, match="if it is UTF-16 without a mark, --encoding utf-16-le"):
            columns(tmp_path, text.encode(encoding))


def test_compressed_text_is_read(tmp_path):
    assert values(columns(tmp_path, gzip.compress(b"time,u\n0,0.5\n1,1.5\n2,2.5\n"), "a.csv.gz")) == TIME_U


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            "# scope\n\ntime,u,x\n0,1,2\n1,1,2\n\n2,1,2,9\n3,1,2\n",
            r"a.csv: line 7 has 4 cells and the rows have 3; mend",
        ),
        ("time,u\n\n# c\n0,1\n1,oops\n2,3\n3,4\n4,5\n5,6\n", r"a.csv: column 'u', line 5: 'oops' is not a number"),
        ("time,u,u\n0,1,2\n1,2,3\n", "two columns are called 'u'"),
        (
            "time,u\n0,1,2\n1,2,3\n",
            r"line 1 has 2 names and the rows have 3 cells; mend one of them, or --names-line 0",
        ),
        ("# c\ntime,u\n0,0,0,5\n1,0,1,5\n", r"line 2 has 2 names .* 4 cells; is a comma both decimal sign and sep"),
        ("time,u,x,v\n0,1,2\n1,2,3\n", "line 1 has 4 names and the rows have 3 cells"),
        ("\n\n", "is empty"),
        (b"a,b\n\0\1\2\3,1\n", "is not text"),
    ],
)
def test_read_error_names_the_line_number_of_the_file(tmp_path, content, words):
    with pytest.raises(UserError, match=words):
        columns(tmp_path, content).numbers("u", "u")


def test_options_override_the_detected_layout(tmp_path):
    content = "1,2\nout,7\ntime,u\nms,V\n0,0.5\n1,1.5\n2,2.5\n"
    assert values(columns(tmp_path, content, skip=2)) == TIME_U
    named = columns(tmp_path, content, names_line=3, units_line=4)
    assert values(named) == TIME_U and named.units == {"time": "ms", "u": "V"}
    assert values(columns(tmp_path, "0:1:2\n3:4:5\n", separator=":", names_line=0)) == {
        "1": [0, 3], "2": [1, 4], "3": [2, 5]
    }  # fmt: skip


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"decimal": "x"}, "--decimal"),
        ({"separator": "ab"}, "--separator.*one sign"),
        ({"names_line": -1}, "--names-line"),
        ({"names_line": 40}, "there is no line 40 for the names; the file has 3"),
        ({"encoding": "klingon"}, "--encoding klingon: no such encoding"),
        ({"encoding": "ascii"}, "a.csv:1: this is not ascii"),
    ],
)
def test_invalid_text_options_are_refused(tmp_path, options, words):
    (tmp_path / "a.csv").write_text("t,\u00b5\n0,1\n1,2")
    with pytest.raises(UserError, match=words):
        read(tmp_path / "a.csv", with_options(Plan(), None, [], [], None, [], [], False, options).text)


def test_text_options_are_refused_for_other_formats(tmp_path):
    np.savez(tmp_path / "a.npz", x=np.arange(3.0))
    with pytest.raises(UserError, match=r"a.npz is read as npz, and --decimal applies only to text files"):
        read(tmp_path / "a.npz", TextPlan(decimal=","))


@pytest.mark.parametrize(
    ("maps", "found"),
    [
        (["u=Torque, Request", "x=pos"], {"u": "Torque, Request", "x": "pos"}),
        (["u=Torque, Request,x=pos,t=a, b, c"], {"u": "Torque, Request", "x": "pos", "t": "a, b, c"}),
    ],
)
def test_column_name_may_contain_a_comma(maps, found):
    plan = with_options(Plan(), "axis", maps, [], None, [], [], False)
    assert {name: column.column for name, column in plan.columns.items()} == found


def test_column_list_without_an_equals_sign_gives_a_hint(tmp_path):
    with pytest.raises(UserError, match=r"no column 'vir,q'.*several are given as ours=theirs,ours=theirs"):
        columns(tmp_path, "t,vir,qm\n0,1,2\n1,2,3\n").has("vir,q", "u")


def case(folder, options, rows=60, rate=1000.0, x=(0.0, 0.017098)):
    return pytest.param(folder, options, rows, rate, x, id=folder)


U, TUX = "--map t=time,u=u,x=x", "--map t=TIME,u=CH1,x=CH2 --unit x=m"


@needs_failing
@pytest.mark.parametrize(
    ("file", "options", "rows", "rate", "x"),
    [
        case("csv_commented_header/klipper.csv", "--map t=time,u=accel_x,x=accel_y"),
        case("csv_commented_header/savetxt.txt", U),
        case("csv_commented_header/space.txt", U),
        case("csv_commented_header/pipe.csv", U),
        case("csv_epoch_ns/epoch_ns_1M.csv", U, rate=1e6),
        case("csv_epoch_ns/epoch_ns.csv", U, rate=1e4),
        case("csv_grouped_thousands/de_group.csv", "--map t=Zeit,u=u,x=x", x=(0.98, 1.039)),
        case("csv_grouped_thousands/en_group.txt", U, x=(1.98, 2.039)),
        case("csv_iso_timestamps/iso.csv", U),
        case("csv_iso_timestamps/isoT.csv", U),
        case("csv_iso_timestamps/iso_s.csv", U, rate=1.0),
        case("csv_preamble/tek.csv", TUX),
        case("csv_preamble/oneblank.csv", U),
        case("csv_preamble/sepbom.csv", U, rows=3, x=(0.0002, 0.0004)),
        case("csv_preamble/trailing.csv", U),
        case("csv_units_in_name/slash.csv", "--map 't=Zeit t / s,u=Spannung U / V,x=Weg x / mm'"),
        case("csv_units_row/pico.csv", "--map 't=Time,u=Channel A,x=Channel B' --unit x=mm"),
        case("csv_units_row/keysight.csv", "--map t=x-axis,u=1,x=2"),
        case("csv_utf16/utf16.csv", U),
        case("map_comma/commahead.csv", "--map t=time --map 'u=Torque, Request' --map x=pos", x=(0.0, 1.7098e-5)),
    ],
)
def test_formerly_failing_recordings_are_read(tmp_path, file, options, rows, rate, x):
    assert (
        main(["import", str(FAILING / file), "--plant", "axis", *shlex.split(options), "-o", str(tmp_path / "b")]) == 0
    )
    found = load_bundle(tmp_path / "b")
    assert found.case["sample_rate"] == pytest.approx(rate, rel=1e-9)
    assert len(found.columns["x"]) == rows
    assert (found.columns["x"][0], found.columns["x"][-1]) == pytest.approx(x, rel=1e-3, abs=1e-12)


@needs_failing
@pytest.mark.parametrize(
    ("file", "options", "words"),
    [
        ("csv_iso_timestamps/posdate.csv", U, "holds dates or durations; only t can be one"),
        ("csv_units_in_name/suffix.csv", "--map t=time_ms,u=u_mV,x=x_mm", "--unit t=ms if it is"),
        ("csv_preamble/rowno.csv", U, "line 8 has 4 cells and the rows have 3"),
        ("csv_preamble/tds.csv", "--map t=4,u=5,x=5", "line 4 has 3 cells"),
        ("csv_units_row/rigol.csv", "--map t=X,u=CH1,x=CH2", r"column 'X' \(t\) is a number without unit.*--unit t="),
    ],
)
def test_unsuitable_recordings_are_refused(tmp_path, capsys, file, options, words):
    assert (
        main(["import", str(FAILING / file), "--plant", "axis", *shlex.split(options), "-o", str(tmp_path / "b")]) == 2
    )
    assert re.search(words, capsys.readouterr().err) and not (tmp_path / "b").exists()


@needs_failing
@pytest.mark.parametrize(
    ("file", "options", "rows", "said"),
    [
        ("mcap_truncated/trunc.mcap", "", 2140, "cut off or damaged at byte 214650: 2140 messages are whole and taken"),
        (
            "mat_struct_array/swt2.mat",
            "--map t=ScopeData.time,u=ScopeData.signals.1.values,x=ScopeData.signals.2.values", 600, "600 rows at 1000",
        ),
        (
            "mat_struct_array/v73_structarr.mat",
            "--map t=ScopeData.time,u=ScopeData.signals.1.values,x=ScopeData.signals.2.values", 600, "600 rows at 1000",
        ),
        ("mat_struct_array/cell.mat", "--map t=data.1,u=data.2,x=data.3", 600, "600 rows at 1000"),
    ],
)  # fmt: skip
def test_formerly_failing_files_of_other_formats_are_read(tmp_path, capsys, file, options, rows, said):
    assert (
        main(["import", str(FAILING / file), "--plant", "axis", *shlex.split(options), "-o", str(tmp_path / "b")]) == 0
    )
    assert said in capsys.readouterr().out and len(load_bundle(tmp_path / "b").columns["x"]) == rows
