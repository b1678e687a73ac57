"""JSON and MCAP: nested names, lists, time stamps, gaps, truncated files, compressed files."""

import bz2
import gzip
import json
import lzma

import numpy as np
import pytest
from mcap import writer as mcap_writer

from rtctl.config.errors import UserError
from rtctl.trace.bundle import load_bundle
from rtctl.trace.imports import limits, read
from rtctl.trace.imports.make import make_bundle
from rtctl.trace.imports.plan import Plan

N = 50
EPOCH = 1_700_000_000


def rows(n=N):
    return [{"t": k / 100, "x": 2 * k} for k in range(n)]


def written(path, found, **how):
    path.write_text(json.dumps(found, **how))
    return path


def as_lines(path, found):
    path.write_text("\n".join(map(json.dumps, found)) + "\n")
    return path


def message(k):
    """A joint state message of ROS 2."""
    stamp = {"sec": EPOCH + k // 10, "nanosec": 100_000_000 * (k % 10)}
    return {
        "header": {"stamp": stamp, "frame_id": "base"},
        "position": [0.1 * k, 0.2 * k],
        "text": f"{k}.5",
        "ok": True,
    }


def test_nested_names_lists_and_time_stamps_are_columns(tmp_path):
    table = read(as_lines(tmp_path / "a.jsonl", map(message, range(N))))
    assert set(table.columns) == {"header.stamp", "position.1", "position.2", "text", "ok"}
    assert table.columns["header.stamp"][11].astype(np.int64) == (EPOCH + 1) * 10**9 + 10**8
    assert table.times("header.stamp", 1.0) == pytest.approx(np.arange(N) / 10, abs=1e-12)
    assert table.numbers("text", "x")[3] == 3.5 and table.left == {"header.frame_id": "text ('base')"}
    with pytest.raises(UserError, match=r"'header.frame_id' .* is no column: text"):
        table.numbers("header.frame_id", "x")


@pytest.mark.parametrize(
    "stamp", [{"secs": 5, "nsecs": 7}, {"sec": 5, "nsec": 7}, {"seconds": 5, "nanos": 7}, {"sec": 5, "nanosec": 7}]
)
def test_spellings_of_a_time_stamp(tmp_path, stamp):
    table = read(as_lines(tmp_path / "a.jsonl", [{"at": stamp, "x": k, **stamp} for k in range(3)]))
    assert table.columns["at"].astype(np.int64).tolist() == [5_000_000_007] * 3
    assert table.columns["stamp"].dtype == "timedelta64[ns]"


def test_fields_missing_in_some_messages_are_named(tmp_path):
    found = [row if k % 5 else {"t": row["t"]} for k, row in enumerate(rows())]
    table = read(as_lines(tmp_path / "a.jsonl", found))
    assert table.notes == ("x is missing in 10 of 50 lines",)
    with pytest.raises(UserError, match=r"column 'x', line 1, and 9 more: empty or nan"):
        table.numbers("x", "x")


@pytest.mark.parametrize("indent", [None, 1])
@pytest.mark.parametrize(
    ("found", "names"),
    [
        (rows(), ["t", "x"]),
        ({"units": {"x": "mm"}, "t": [0.0, 0.1, 0.2], "x": [1, 2, 3], "gain": 3}, ["t", "x"]),
        ({"meta": {"a": 1}, "samples": rows()}, ["samples.t", "samples.x"]),
        ([["t", "x"], *([k / 100, k] for k in range(N))], ["t", "x"]),
        ({"columns": ["t", "x"], "index": [0, 1], "data": [[0, 1], [1, 2]]}, ["t", "x"]),
        ({"t": {"0": 0.0, "1": 0.1}, "x": {"0": 1, "1": 2}}, ["t", "x"]),
        (
            {"signals": [{"name": n, "unit": "mm", "data": [1, 2, 3]} for n in "ux"]},
            ["signals.1.data", "u", "signals.2.data", "x"],
        ),
    ],
)
def test_json_documents_are_read(tmp_path, found, names, indent):
    table = read(written(tmp_path / "a.json", found, indent=indent))
    assert list(table.columns) == names
    assert set(table.units.values()) <= {"mm"} and (table.units != {}) == ("mm" in json.dumps(found))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"t":1}\n{"t":2\n{"t":3}\n', "a.json: line 2 is no JSON object"),
        (json.dumps(rows())[:-20], r"a.json: line 1, character \d+: it is cut off there"),
        (json.dumps(rows(), indent=1)[:-20], r"a.json: line 199, character \d+: it is cut off there"),
        ("[" * 5000 + "]" * 5000, "nested too deeply"),
        ("", "is empty"),
        (json.dumps([["t", "x"], [0, 1], [1, 2, 3]]), "row 2 has 3 values where there are 2 names"),
    ],
)
def test_damaged_json_is_refused(tmp_path, text, words):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(UserError, match=words):
        read(tmp_path / "a.json")


def test_truncated_json_lines_give_the_complete_lines(tmp_path):
    (tmp_path / "a.jsonl").write_text("\n".join(map(json.dumps, rows()))[:-5])
    table = read(tmp_path / "a.jsonl")
    assert len(table.columns["t"]) == N - 1
    assert table.notes == ("the last line, 50, is cut off: 49 lines are whole and taken",)


@pytest.mark.parametrize(
    ("suffix", "pack"), [(".gz", gzip.compress), (".bz2", bz2.compress), (".xz", lzma.compress), ("", gzip.compress)]
)
def test_compressed_files_are_read(tmp_path, suffix, pack):
    path = tmp_path / f"a.csv{suffix}"
    path.write_bytes(pack(b"t,u,x\n" + b"".join(b"%d,%d,1\n" % (k, k) for k in range(9)) + b"9,oops,1\n"))
    table = read(path)
    assert table.path == path and table.columns["t"].tolist() == list(range(10))
    with pytest.raises(UserError, match=rf"^{path}: column 'u', line 11: 'oops' is not a number"):
        table.numbers("u", "u")
    path.write_bytes(pack(b"t,x\n0,1\n" * 99)[:-6])
    with pytest.raises(UserError, match=f"{path}: the .* file is damaged or cut off; pack it again"):
        read(path)


def test_compressed_file_that_unpacks_beyond_the_limit_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv(limits.VARIABLE, str(2**-10))
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(b"t,x\n" + b"0,1\n" * (1 << 20)))
    with pytest.raises(UserError, match=r"a.csv.gz: its unpacked bytes, and more, take .* MiB in memory and 1 MiB"):
        read(tmp_path / "a.csv.gz")


# MCAP


@pytest.fixture
def mcap(tmp_path):
    """`mcap` writes messages {topic: (encoding, [bytes])} at intervals of 10 ms."""
    writers = pytest.importorskip("mcap.writer")

    def write(topics, compression="ZSTD", chunk=4096, schema=None):
        path = tmp_path / "a.mcap"
        with path.open("wb") as file:
            writer = writers.Writer(file, compression=writers.CompressionType[compression], chunk_size=chunk)
            writer.start()
            for topic, (encoding, messages) in topics.items():
                text = json.dumps(schema or {}).encode()
                kind = "jsonschema" if encoding == "json" else "ros2msg"
                channel = writer.register_channel(
                    topic, encoding, writer.register_schema(f"sensor_msgs/msg/{topic[1:]}", kind, text)
                )
                for k, data in enumerate(messages):
                    writer.add_message(channel, EPOCH * 10**9 + k * 10**7, data, 0, k)
            writer.finish()
        return path

    return write


def as_json(found):
    return "json", [json.dumps(one).encode() for one in found]


@pytest.mark.parametrize("compression", ["NONE", "ZSTD", "LZ4"])
def test_truncated_mcap_gives_the_complete_messages(mcap, tmp_path, compression):
    path = mcap({"/axis": as_json([{"u": k % 7 / 3, "x": k} for k in range(2000)])}, compression)
    assert len(read(path).columns["x"]) == 2000 and read(path).notes == ()
    whole = path.read_bytes()
    counts = []
    for share in (0.9, 0.5, 0.1):
        path.write_bytes(whole[: int(share * len(whole))])
        table = read(path)
        counts.append(len(table.columns["x"]))
        assert table.columns["x"].tolist() == list(range(counts[-1]))
        words = f"cut off or damaged at byte .*: {counts[-1]} messages are whole and taken"
        assert len(table.notes) == 1 and pytest.importorskip("re").search(words, table.notes[0])
    assert counts == sorted(counts, reverse=True) and 0 < counts[-1] < counts[0] < 2000
    made = make_bundle(table, Plan(plant="axis"), tmp_path / "b")
    assert made.rate == pytest.approx(100) and made.rows == counts[-1] and made.notes[0] == table.notes[0]
    path.write_bytes(whole[:60])
    with pytest.raises(UserError, match="has no whole message; it is cut off or damaged at byte"):
        read(path)


def test_mcap_in_cdr_is_refused_by_name(mcap):
    with pytest.raises(UserError, match=(
        r"a.mcap has no messages in JSON or protobuf, which can be read; it has /JointState: 5 messages in cdr, schema "
        r"sensor_msgs/msg/JointState \(ros2msg\); decode them with mcap-ros2-support"
    )):  # fmt: skip
        read(mcap({"/JointState": ("cdr", [b"\0" * 20] * 5)}))


def test_topics_of_other_encodings_are_named_next_to_json_topics(mcap):
    table = read(mcap({"/axis": as_json(rows()), "/tf": ("protobuf", [b"x"] * 3)}))
    assert table.notes == ("/tf is no column: 3 messages in protobuf, schema sensor_msgs/msg/tf (ros2msg)",)
    with pytest.raises(UserError, match=r"'/tf' .* is no column: 3 messages in protobuf"):
        table.has("/tf", "x")


def tree(fields):
    """Descriptor of `pkg.Row` from (name, type, number, more) and a nested `Vec`."""
    from google.protobuf.descriptor_pb2 import FieldDescriptorProto as Field
    from google.protobuf.descriptor_pb2 import FileDescriptorSet

    found = FileDescriptorSet()
    file = found.file.add(name="row.proto", package="pkg", syntax="proto3")
    row, vec = file.message_type.add(name="Row"), file.message_type.add(name="Vec")
    vec.field.add(name="x", number=1, type=Field.TYPE_INT32, label=Field.LABEL_OPTIONAL)
    for number, (name, kind, more) in enumerate(fields, 1):
        label = Field.LABEL_REPEATED if more == "list" else Field.LABEL_OPTIONAL
        of = {"type_name": ".pkg.Vec"} if kind == "MESSAGE" else {}
        row.field.add(name=name, number=number, type=getattr(Field, f"TYPE_{kind}"), label=label, **of)
    return found.SerializeToString()


@pytest.fixture
def protobuf_mcap(tmp_path):
    def write(fields, rows, spoil=lambda data: data):
        from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

        descriptor = tree(fields)
        pool = descriptor_pool.DescriptorPool()
        pool.Add(descriptor_pb2.FileDescriptorSet.FromString(descriptor).file[0])
        kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("pkg.Row"))
        path = tmp_path / "a.mcap"
        with path.open("wb") as file:
            writer = mcap_writer.Writer(file)
            writer.start()
            channel = writer.register_channel(
                "/row", "protobuf", writer.register_schema("pkg.Row", "protobuf", spoil(descriptor))
            )
            for k, row in enumerate(rows):
                writer.add_message(channel, k * 10**7, kind(**row).SerializeToString(), 0, k)
            writer.finish()
        return path

    return write


def test_protobuf_messages_of_any_shape_are_read(protobuf_mcap):
    fields = [
        ("a", "DOUBLE", ""),
        ("n", "INT64", ""),
        ("v", "MESSAGE", ""),
        ("p", "FLOAT", "list"),
        ("s", "STRING", ""),
    ]
    path = protobuf_mcap(fields, [{"a": k / 3, "n": -k, "v": {"x": k}, "p": [k, 2 * k], "s": "on"} for k in range(N)])
    table = read(path)
    assert table.columns["a"].tolist() == [k / 3 for k in range(N)] and table.columns["n"].tolist() == [
        -k for k in range(N)
    ]
    assert table.columns["v.x"].tolist() == list(range(N)) and table.columns["p.2"].tolist() == [
        2.0 * k for k in range(N)
    ]
    assert table.left == {"s": "text ('on')"} and table.clock == "log_time"


def test_damaged_protobuf_is_refused(protobuf_mcap):
    with pytest.raises(UserError, match=r"the descriptor of /row has no message pkg.Row"):
        read(protobuf_mcap([("a", "DOUBLE", "")], [{"a": 1.0}], spoil=lambda data: data[:-9]))


def test_mcap_units_and_time_stamps_are_read(mcap, tmp_path):
    schema = {"properties": {"a": {"type": "object", "properties": {"x": {"type": "number", "unit": "mm"}}}}}
    found = [{"a": {"x": k}, "u": k % 2, "stamp": {"sec": k, "nanosec": 5}} for k in range(N)]
    table = read(mcap({"/axis": as_json(found)}, schema=schema))
    assert table.units == {"a.x": "mm", "log_time": "s"} and table.clock == "log_time"
    assert any("take it as the clock with --map t=stamp" in note for note in table.notes)
    make_bundle(table, Plan(plant="axis", columns={"t": "stamp", "u": "u", "x": "a.x"}), tmp_path / "b")
    bundle = load_bundle(tmp_path / "b")
    assert bundle.columns["t"].tolist() == list(range(N)) and bundle.columns["x"] == pytest.approx(np.arange(N) / 1e3)


def test_mcap_chunk_beyond_the_limit_is_refused(mcap, monkeypatch):
    path = mcap({"/axis": as_json([{"x": 0, "pad": " " * 100_000}] * 40)}, chunk=1 << 22)
    monkeypatch.setenv(limits.VARIABLE, str(2**-10))
    assert path.stat().st_size < 1 << 16
    with pytest.raises(UserError, match=r"its chunks take .* MiB in memory and 1 MiB are taken at most"):
        read(path)


def test_message_that_is_not_json_is_refused(mcap):
    with pytest.raises(UserError, match=r"message 2 of /axis is no JSON: b'\{"):
        read(mcap({"/axis": ("json", [b"{}", b"{"])}))
