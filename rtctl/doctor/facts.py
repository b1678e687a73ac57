"""All checks, in the order of their usual cost to a loop, largest first."""

from collections.abc import Callable

from rtctl.doctor import cpus, kernel, memory, power, rights, virtual
from rtctl.doctor.finding import Finding, Tree

CHECKS: tuple[Callable[[Tree], Finding], ...] = (
    kernel.preemption,
    rights.memory_lock,
    cpus.count,
    kernel.throttling,
    virtual.machine,
    power.idle_states,
    cpus.isolation,
    power.governor,
    memory.swap,
    cpus.threads,
    memory.huge_pages,
    kernel.clock_source,
)
RANK = {"bad": 0, "fair": 1}


def facts(tree: Tree, priority: int, may_fifo: bool, stolen: Finding) -> list[Finding]:
    """All findings: the right to SCHED_FIFO, the stolen time, then the checks of files."""
    return [rights.fifo(tree, priority, may_fifo), stolen, *(check(tree) for check in CHECKS)]


def changes(findings: list[Finding]) -> list[Finding]:
    """Findings with a change, in the order of gain: bad before fair, each in the order of the checks."""
    wanted = [f for f in findings if f.verdict in RANK and f.change]
    return sorted(wanted, key=lambda f: RANK[f.verdict])
