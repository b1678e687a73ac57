import pytest

from rtctl.doctor import virtual
from rtctl.doctor.virtual import Times

STAT = """cpu  100 0 50 800 10 0 5 35 7 0
cpu0 60 0 30 400 5 0 2 3 0 0
cpu1 40 0 20 400 5 0 3 32 7 0
intr 1 2 3
"""


@pytest.mark.parametrize(
    ("files", "verdict", "found"),
    [
        ({"proc/cpuinfo": "flags\t\t: fpu hypervisor lm\n"}, "fair", "yes"),
        ({"proc/cpuinfo": "flags : hypervisor\n", "sys/class/dmi/id/product_name": "KVM\n"}, "fair", "KVM"),
        ({"sys/hypervisor/type": "xen\n"}, "fair", "xen"),
        ({"proc/device-tree/hypervisor/compatible": "linux,kvm\0"}, "fair", "yes"),
        ({"proc/cpuinfo": "flags : fpu lm\nmodel name : hypervisor-like\n"}, "good", "no"),
        ({"proc/cpuinfo": "Features : fp asimd\n"}, "unknown", "does not tell"),
        ({}, "unknown", "does not tell"),
    ],
)
def test_virtual_machine_finding(tree, files, verdict, found):
    said = virtual.machine(tree(files))
    assert (said.verdict, found in said.found) == (verdict, True)
    assert bool(said.change) == (verdict == "fair")


def test_cpu_times_are_read(tree):
    t = tree({"proc/stat": STAT})
    assert virtual.times(t, 1) == Times(500, 32)
    assert virtual.times(t, None) == Times(1000, 35)
    assert virtual.times(t, 2) is None


def test_unreadable_cpu_times_are_none(tree):
    assert virtual.times(tree(), 0) is None


@pytest.mark.parametrize(
    ("before", "after", "verdict"),
    [
        (Times(1000, 10), Times(3000, 10), "good"),
        (Times(1000, 10), Times(3000, 12), "fair"),
        (Times(1000, 10), Times(3000, 13), "bad"),
        (Times(1000, 10), Times(1000, 10), "unknown"),
        (None, Times(1, 1), "unknown"),
        (Times(1, 1), None, "unknown"),
    ],
)
def test_steal_time_finding(before, after, verdict):
    said = virtual.steal(before, after, "during the measurement")
    assert said.verdict == verdict
    assert bool(said.change) == (verdict in ("fair", "bad"))


def test_share_of_steal_time():
    assert virtual.steal(Times(0, 0), Times(1000, 25), "since boot").found == "2.5 % since boot"
