import pytest

from rtctl.doctor import cpus

CPU = "sys/devices/system/cpu"


def status(mine: str) -> dict[str, str]:
    return {"proc/self/status": f"CapEff:\t0\nCpus_allowed_list:\t{mine}\n", f"{CPU}/online": "0-3\n"}


def isolated(cpu: str, cmdline: str = "quiet", tickless: str = "") -> dict[str, str]:
    return {f"{CPU}/isolated": f"{cpu}\n", f"{CPU}/nohz_full": f"{tickless}\n", "proc/cmdline": cmdline}


@pytest.mark.parametrize(
    ("files", "verdict", "found"),
    [
        (status("0-3"), "good", "4 of 4"),
        (status("2"), "bad", "1 of 4"),
        ({**status("0-1"), "sys/fs/cgroup/cpu.max": "150000 100000\n"}, "fair", "quota 150000"),
        ({**status("0-1"), "sys/fs/cgroup/cpu.max": "max 100000\n"}, "good", "2 of 4"),
        ({**status("0"), f"{CPU}/isolated": "3"}, "good", "1 of 4"),
        ({}, "unknown", "hidden"),
    ],
)
def test_cpu_count_finding(tree, files, verdict, found):
    said = cpus.count(tree(files))
    assert (said.verdict, found in said.found) == (verdict, True)
    assert bool(said.change) == (verdict in ("fair", "bad"))


@pytest.mark.parametrize(
    ("files", "verdict"),
    [
        ({**status("0-2"), **isolated("3", "isolcpus=3 irqaffinity=0-2", "3")}, "good"),
        ({**status("0-2"), **isolated("3", "isolcpus=3 irqaffinity=0-3", "3")}, "fair"),
        ({**status("0-2"), **isolated("3", "isolcpus=3 irqaffinity=0-2")}, "fair"),
        ({**status("0-2"), **isolated("3")}, "fair"),
        ({**status("0-3"), **isolated("")}, "fair"),
        (status("0-3"), "unknown"),
    ],
)
def test_cpu_isolation_finding(tree, files, verdict):
    said = cpus.isolation(tree(files))
    assert said.verdict == verdict
    assert ("isolcpus=managed_irq,domain,3" in said.command) == (verdict == "fair")
    assert ("loop.cpu: 3" in said.change) == (verdict != "unknown")


def test_single_cpu_cannot_be_isolated(tree):
    said = cpus.isolation(tree({**status("0"), **isolated("")}))
    assert (said.verdict, said.command) == ("fair", "")


def test_recommended_cpu_of_the_loop(tree):
    assert cpus.loop_cpu(tree()) is None
    t = tree(status("0-2"))
    assert cpus.loop_cpu(t) == 2
    assert cpus.loop_cpu(tree({f"{CPU}/isolated": "1,3"})) == 3
    assert cpus.isolated_cpus(tree({"sys/fs/cgroup/cpuset.cpus.isolated": "2"})) == [1, 2, 3]


@pytest.mark.parametrize(
    ("files", "verdict", "found"),
    [
        ({f"{CPU}/smt/active": "0"}, "good", "off"),
        ({f"{CPU}/smt/active": "0", "proc/cpuinfo": "flags\t: fpu hypervisor\n"}, "unknown", "host"),
        ({f"{CPU}/smt/active": "1"}, "fair", "on"),
        (
            {**status("0-3"), f"{CPU}/smt/active": "1", f"{CPU}/cpu3/topology/thread_siblings_list": "1,3"},
            "fair", "CPU 3 shares a core with 1,3",
        ),
        ({}, "unknown", "hidden"),
    ],
)  # fmt: skip
def test_smt_finding(tree, files, verdict, found):
    said = cpus.threads(tree(files))
    assert (said.verdict, found in said.found) == (verdict, True)
