import gzip

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.doctor.finding import Tree, cpu_list

LIMITS = """Limit                     Soft Limit           Hard Limit           Units
Max locked memory         8388608              unlimited            bytes
Max realtime priority     95                   95
Max cpu time              unlimited            unlimited            seconds
"""


def test_missing_file_reads_as_none(tree):
    t = tree()
    assert t.read("proc/version") is None
    assert t.number("sys/kernel/realtime") is None
    assert t.glob("sys/*/x") == []
    assert t.opens("dev/cpu_dma_latency") is None
    assert t.option("preempt") is None
    assert t.limit("Max locked memory") is None
    assert t.status("CapEff") is None
    assert t.capable(14) is False


def test_folder_in_place_of_a_file_reads_as_none(tree, tmp_path):
    (tmp_path / "proc").mkdir()
    assert tree().read("proc") is None
    assert tree().opens("proc") is False


@pytest.mark.parametrize("error", [PermissionError, OSError])
def test_unreadable_file_reads_as_none(tree, monkeypatch, error):
    t = tree({"proc/swaps": "x"})

    def refuse(self):
        raise error

    monkeypatch.setattr("pathlib.Path.read_bytes", refuse)
    assert t.read("proc/swaps") is None


def test_compressed_file_is_read(tree, tmp_path):
    (tmp_path / "config.gz").write_bytes(gzip.compress(b"CONFIG_PREEMPT_RT=y\n"))
    (tmp_path / "broken.gz").write_bytes(gzip.compress(b"CONFIG_PREEMPT_RT=y\n")[:12])
    assert tree().read("config.gz") == "CONFIG_PREEMPT_RT=y"
    assert tree().read("broken.gz") is None


def test_glob_is_in_numeric_order_and_numbers_are_parsed(tree):
    t = tree({"a/cpu10/x": "7\n", "a/cpu2/x": "x", "a/cpu1/x": "-1"})
    assert t.glob("a/cpu[0-9]*/x") == ["a/cpu1/x", "a/cpu2/x", "a/cpu10/x"]
    assert [t.number(p) for p in t.glob("a/cpu[0-9]*/x")] == [-1, None, 7]


def test_kernel_command_line_options(tree):
    t = tree({"proc/cmdline": "quiet preempt=none isolcpus=1,2 preempt=full\n"})
    assert (t.option("preempt"), t.option("quiet"), t.option("isolcpus"), t.option("nohz_full")) == (
        "full", "", "1,2", None,
    )  # fmt: skip


def test_limits_and_capabilities(tree):
    t = tree({"proc/self/limits": LIMITS, "proc/self/status": "Name:\tx\nCapEff:\t0000000000004000\n"})
    assert t.limit("Max locked memory") == 8388608
    assert t.limit("Max realtime priority") == 95
    assert t.limit("Max cpu time") == float("inf")
    assert t.capable(14) and not t.capable(23)


def test_this_machine_is_read_without_an_error():
    assert Tree().read("proc/self/status")
    assert Tree().limit("Max locked memory") is not None


@pytest.mark.parametrize(
    ("text", "cpus"),
    [("0-2,5", [0, 1, 2, 5]), ("", []), ("(null)", []), ("3\n", [3]), ("managed_irq,domain,1", [1]), ("2-1", [])],
)
def test_cpu_list_is_parsed(text, cpus):
    assert cpu_list(text) == cpus


@settings(deadline=None)
@given(st.sets(st.integers(0, 300)))
def test_cpu_list_of_any_set_survives_a_round_trip(cpus):
    assert cpu_list(",".join(map(str, cpus))) == sorted(cpus)
