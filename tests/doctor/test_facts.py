from rtctl.doctor import facts, virtual
from rtctl.doctor.finding import Finding

STOLEN = Finding("stolen time", "none", "good")


def test_machine_without_readable_files_gives_unknown_verdicts(tree):
    found = facts.facts(tree(), 80, True, virtual.steal(None, None, ""))
    assert len({f.name for f in found}) == len(found) == len(facts.CHECKS) + 2
    assert {f.name: f.verdict for f in found}.pop("SCHED_FIFO") == "good"
    assert {f.verdict for f in found[1:]} == {"unknown"}
    assert facts.changes(found) == []


def test_every_verdict_that_is_not_good_names_its_cost_and_its_remedy(tree):
    files = {
        "proc/sys/kernel/version": "#1 SMP",
        "proc/self/limits": "Max locked memory   1024  1024 bytes\n",
        "proc/self/status": "Cpus_allowed_list:\t0\n",
        "proc/swaps": "Filename\n/dev/sda2 x\n",
        "proc/cmdline": "",
    }
    for f in facts.facts(tree(files), 80, False, STOLEN):
        if f.verdict in ("fair", "bad") and f.name != "isolated CPUs":  # a single CPU cannot be isolated
            assert f.cost and f.change and f.command, f


def test_bad_findings_come_first_then_the_order_of_the_checks():
    found = [
        Finding("a", "", "fair", change="x"),
        Finding("b", "", "bad", change="x"),
        Finding("c", "", "good", change="x"),
        Finding("d", "", "bad", change="x"),
        Finding("e", "", "unknown", change="x"),
        Finding("f", "", "fair"),
    ]
    assert [f.name for f in facts.changes(found)] == ["b", "d", "a"]
