"""CPUs available to a loop, and other users of those CPUs.

Source: kernel documentation, admin-guide/kernel-parameters (isolcpus=, nohz_full=, irqaffinity=) and cgroup-v2.
"""

from rtctl.doctor.finding import Finding, Tree, cpu_list
from rtctl.doctor.virtual import hypervisor

CPU = "sys/devices/system/cpu"
GRUB = "GRUB_CMDLINE_LINUX of /etc/default/grub, then sudo update-grub and boot"


def allowed_cpus(tree: Tree) -> list[int]:
    """CPUs that this process may use; empty where that is hidden."""
    return cpu_list(tree.status("Cpus_allowed_list") or "")


def online(tree: Tree) -> list[int]:
    """CPUs that are online; empty where that is hidden."""
    return cpu_list(tree.read(f"{CPU}/online") or "")


def isolated_cpus(tree: Tree) -> list[int]:
    """CPUs that the scheduler does not use, by isolcpus= or by an isolated cpuset."""
    files = (f"{CPU}/isolated", "sys/fs/cgroup/cpuset.cpus.isolated")
    return sorted({cpu for file in files for cpu in cpu_list(tree.read(file) or "")})


def loop_cpu(tree: Tree) -> int | None:
    """CPU for a loop: the last isolated CPU, else the last allowed one, None where both lists are hidden."""
    return max(isolated_cpus(tree) or allowed_cpus(tree), default=None)


def count(tree: Tree) -> Finding:
    """Check of the number of CPUs for plant, supervisor and loop."""
    name, mine = "CPUs", allowed_cpus(tree)
    if not mine:
        return Finding(name, "/proc/self/status is hidden", "unknown")
    there = online(tree)
    found = f"{len(mine)} of {len(there)} allowed" if there else f"{len(mine)} allowed"
    usable = len(set(mine) | set(isolated_cpus(tree)))
    quota = (tree.read("sys/fs/cgroup/cpu.max") or "max").split()
    if usable < 2:
        return Finding(
            name, found, "bad", "loop, supervisor, recorder and all else share it",
            "give this machine or container a second CPU", "docker run --cpuset-cpus 0,1 ...   (a container)",
        )  # fmt: skip
    if quota[0] != "max":
        return Finding(
            name, f"{found}, quota {quota[0]} of {quota[-1]} us", "fair",
            "threads that are not SCHED_FIFO (supervisor, recorder) stop when the quota is used up",
            "lift the quota: give CPUs instead", "docker run --cpuset-cpus 0,1 ... without --cpus",
        )  # fmt: skip
    return Finding(name, found, "good")


def isolation(tree: Tree) -> Finding:
    """Check that a CPU is free of other tasks, of the scheduler's tick and of interrupts."""
    name, isolated, mine = "isolated CPUs", isolated_cpus(tree), allowed_cpus(tree)
    if tree.read("proc/cmdline") is None and tree.read(f"{CPU}/isolated") is None:
        return Finding(name, "/proc/cmdline is hidden", "unknown")
    tickless = cpu_list(tree.read(f"{CPU}/nohz_full") or tree.option("nohz_full") or "")
    interrupts = tree.option("irqaffinity")
    cpu = isolated[-1] if isolated else max(mine, default=1)
    wanted = f"isolcpus=managed_irq,domain,{cpu} nohz_full={cpu} rcu_nocbs={cpu} irqaffinity=0"
    if not isolated:
        if len(mine) < 2:
            return Finding(name, "none, and no second CPU that could be", "fair")
        return Finding(
            name, "none", "fair", "other tasks, the scheduler's tick and interrupts share the loop's CPU",
            f"keep CPU {cpu} free and set loop.cpu: {cpu}", f"{wanted}   in {GRUB}",
        )  # fmt: skip
    found = f"{_words(isolated)}; nohz_full {_words(tickless)}; irqaffinity {interrupts or 'not given'}"
    if cpu in tickless and interrupts is not None and cpu not in cpu_list(interrupts):
        return Finding(name, found, "good", change=f"set loop.cpu: {cpu}")
    return Finding(
        name, found, "fair", f"the scheduler's tick or interrupts still come to CPU {cpu}",
        f"keep those off it too, and set loop.cpu: {cpu}", f"{wanted}   in {GRUB}",
    )  # fmt: skip


def threads(tree: Tree) -> Finding:
    """Check whether two CPUs share a core (SMT)."""
    name, active = "SMT", tree.number(f"{CPU}/smt/active")
    if active is None:
        return Finding(name, f"/{CPU}/smt is hidden", "unknown")
    if active == 0:
        if hypervisor(tree):
            return Finding(name, "none seen; the host may share a core all the same", "unknown")
        return Finding(name, "off", "good")
    cpu = loop_cpu(tree)
    sharing = tree.read(f"{CPU}/cpu{cpu}/topology/thread_siblings_list")
    return Finding(
        name, f"on; CPU {cpu} shares a core with {sharing}" if sharing else "on", "fair",
        "what runs on the other thread of the core slows a tick down, and not evenly",
        "switch it off, here or in the firmware", f"echo off | sudo tee /{CPU}/smt/control",
    )  # fmt: skip


def _words(cpus: list[int]) -> str:
    return ",".join(map(str, cpus)) or "none"
