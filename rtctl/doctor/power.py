"""Checks of power saving that delays a loop: frequency governor and idle states of the CPUs.

Source: kernel documentation, admin-guide/pm/cpufreq and admin-guide/pm/cpuidle.
"""

from collections import Counter

from rtctl.doctor.finding import Finding, Tree

DEEP_US = 10  # us, exit latency beyond which an idle state delays a wake-up
UDEV = "/etc/udev/rules.d/90-cpu-dma-latency.rules"


def governor(tree: Tree) -> Finding:
    """Check of the CPUs' frequency governor."""
    name = "frequency governor"
    files = tree.glob("sys/devices/system/cpu/cpu[0-9]*/cpufreq/scaling_governor")
    kinds = Counter(kind for kind in map(tree.read, files) if kind)
    if not kinds:
        return Finding(name, "no cpufreq here: firmware or host chooses", "unknown")
    found = ", ".join(f"{kind} on {count}" for kind, count in kinds.most_common()) + " CPUs"
    if set(kinds) == {"performance"}:
        return Finding(name, found, "good")
    return Finding(
        name, found, "fair", "a tick begins on a slow CPU: wake-up and law take longer, and vary",
        "let the CPUs run at full speed", "sudo cpupower frequency-set -g performance",
    )  # fmt: skip


def idle_states(tree: Tree) -> Finding:
    """Check of the CPU's idle states, their exit latency, and the right to limit them."""
    name = "idle states"
    states = [
        (tree.read(f"{folder}/name") or "?", latency)
        for folder in tree.glob("sys/devices/system/cpu/cpu0/cpuidle/state[0-9]*")
        if (latency := tree.number(f"{folder}/latency")) is not None and tree.number(f"{folder}/disable") != 1
    ]
    if not states:
        return Finding(name, "no cpuidle here: firmware or host chooses", "unknown")
    deepest = max(latency for _, latency in states)
    found = ", ".join(f"{word} {latency} us" for word, latency in states)
    if deepest <= DEEP_US:
        return Finding(name, found, "good")
    allowed = tree.opens("dev/cpu_dma_latency")
    if allowed:
        return Finding(name, f"{found}; rtctl keeps them shallow by /dev/cpu_dma_latency", "good")
    return Finding(
        name, f"{found}; /dev/cpu_dma_latency {'is missing' if allowed is None else 'may not be opened'}",
        "fair" if deepest <= 5 * DEEP_US else "bad", f"a wake-up can be {deepest} us late",
        "let rtctl hold /dev/cpu_dma_latency (a container needs --device /dev/cpu_dma_latency), or switch deep states "
        f"off until the next boot: sudo cpupower idle-set -D {DEEP_US}",
        f"""echo 'KERNEL=="cpu_dma_latency", GROUP="'$(id -gn)'", MODE="0660"' | sudo tee {UDEV}   (then boot)""",
    )  # fmt: skip
