"""Checks of a virtual machine: its hypervisor, and the share of CPU time that the host took (steal).

Source: proc_stat(5) for steal; the flag `hypervisor` is CPUID.1:ECX bit 31.
"""

from typing import NamedTuple

from rtctl.doctor.finding import Finding, Tree

MOST = 1e-3  # largest share of stolen time with the verdict fair


class Times(NamedTuple):
    """Time of one CPU since boot, in ticks of the kernel's clock (USER_HZ)."""

    total: int
    steal: int


def hypervisor(tree: Tree) -> str | None:
    """Name of the hypervisor, "yes" for one without a name, None on hardware or where it is hidden."""
    kind = tree.read("sys/hypervisor/type")
    if kind:
        return kind
    flags = [line for line in (tree.read("proc/cpuinfo") or "").splitlines() if line.startswith("flags")]
    if any("hypervisor" in line.split() for line in flags) or tree.read("proc/device-tree/hypervisor/compatible"):
        return tree.read("sys/class/dmi/id/product_name") or "yes"
    return None


def machine(tree: Tree) -> Finding:
    """Check whether this is a virtual machine."""
    name, kind = "virtual machine", hypervisor(tree)
    if kind is not None:
        return Finding(
            name, kind, "fair", "the host may stop a CPU at any moment, and every timer takes a detour through it",
            "run the loop on hardware; else give this machine CPUs of its own on the host",
            "virsh vcpupin DOMAIN VCPU CPU, with that CPU isolated on the host   (libvirt)",
        )  # fmt: skip
    if "flags" not in (tree.read("proc/cpuinfo") or ""):  # only x86 has flags; without them the result is unknown
        return Finding(name, "/proc/cpuinfo does not tell", "unknown")
    return Finding(name, "no", "good")


def times(tree: Tree, cpu: int | None) -> Times | None:
    """Time of a CPU, or of all CPUs for None; None where it is hidden."""
    for line in (tree.read("proc/stat") or "").splitlines():
        name, *numbers = line.split()
        if name == ("cpu" if cpu is None else f"cpu{cpu}") and len(numbers) >= 8:
            return Times(sum(map(int, numbers[:8])), int(numbers[7]))  # later numbers are included in these
    return None


def steal(before: Times | None, after: Times | None, over: str) -> Finding:
    """Check of the share of time that the host took between two readings; `over` names the interval."""
    name = "stolen time"
    if before is None or after is None:
        return Finding(name, "/proc/stat is hidden", "unknown")
    total = after.total - before.total
    if total <= 0:
        return Finding(name, "too short to tell", "unknown")
    share = (after.steal - before.steal) / total
    found = f"{100 * share:.2g} % {over}" if share > 0 else f"none {over}"
    if share <= 0:
        return Finding(name, found, "good")
    return Finding(
        name, found, "fair" if share <= MOST else "bad", "the host ran something else while the loop was due",
        "give this machine CPUs of its own on the host, or run the loop on hardware",
        "virsh vcpupin DOMAIN VCPU CPU, with that CPU isolated on the host   (libvirt)",
    )  # fmt: skip
