import pytest

from rtctl.doctor import power
from rtctl.doctor.finding import Tree

CPU = "sys/devices/system/cpu"


def governors(*kinds: str) -> dict[str, str]:
    return {f"{CPU}/cpu{n}/cpufreq/scaling_governor": f"{kind}\n" for n, kind in enumerate(kinds)}


def states(**latencies: int) -> dict[str, str]:
    out: dict[str, str] = {}
    for n, (name, latency) in enumerate(latencies.items()):
        folder = f"{CPU}/cpu0/cpuidle/state{n}"
        out |= {f"{folder}/name": name, f"{folder}/latency": str(latency), f"{folder}/disable": "0"}
    return out


@pytest.mark.parametrize(
    ("kinds", "verdict", "found"),
    [
        (("performance", "performance"), "good", "performance on 2"),
        (("performance", "powersave"), "fair", "powersave on 1"),
        (("schedutil",), "fair", "schedutil"),
        ((), "unknown", "no cpufreq"),
    ],
)
def test_governor_finding(tree, kinds, verdict, found):
    said = power.governor(tree(governors(*kinds)))
    assert (said.verdict, found in said.found) == (verdict, True)
    assert ("performance" in said.command) == (verdict == "fair")


def test_shallow_idle_states_need_no_change(tree):
    assert power.idle_states(tree(states(POLL=0, C1=2))).verdict == "good"


def test_deep_idle_states_can_be_prevented_with_access(tree):
    said = power.idle_states(tree({**states(POLL=0, C6=133), "dev/cpu_dma_latency": ""}))
    assert (said.verdict, "C6 133 us" in said.found) == ("good", True)


@pytest.mark.parametrize(("opens", "found"), [(False, "may not be opened"), (None, "is missing")])
def test_deep_idle_states_without_access_are_reported(tree, monkeypatch, opens, found):
    monkeypatch.setattr(Tree, "opens", lambda self, path: opens)
    said = power.idle_states(tree(states(POLL=0, C1=2, C6=133)))
    assert (said.verdict, found in said.found, "133 us" in said.cost) == ("bad", True, True)
    assert "cpu_dma_latency" in said.command
    said = power.idle_states(tree(states(POLL=0, C1=2, C6=30)))
    assert said.verdict == "fair"


def test_disabled_idle_state_does_not_count(tree):
    files = states(POLL=0, C6=133)
    assert power.idle_states(tree({**files, f"{CPU}/cpu0/cpuidle/state1/disable": "1"})).verdict == "good"


def test_unreadable_idle_states_are_unknown(tree):
    assert power.idle_states(tree()).verdict == "unknown"
