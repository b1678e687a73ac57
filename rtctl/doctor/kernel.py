"""Checks of the kernel: preemption model, clock source, real-time throttling.

Source: kernel documentation, admin-guide/kernel-parameters (preempt=, clocksource=); PREEMPT_RT is mainline since 6.12.
"""

import re

from rtctl.doctor.finding import Finding, Tree

RT_KERNEL = (
    "apt install linux-image-rt-$(dpkg --print-architecture)   (Debian); elsewhere a kernel with CONFIG_PREEMPT_RT=y"
)
CLOCKS = ("tsc", "arch_sys_counter", "riscv_clocksource")  # read without a system call, and cheap
SHARED_CLOCKS = ("kvm-clock", "hyperv_clocksource_tsc_page")  # also without a system call, by a page of the host


def preemption(tree: Tree) -> Finding:
    """Check of the preemption model, which decides how long a call into the kernel delays a woken loop."""
    name = "kernel preemption"
    version = tree.read("proc/sys/kernel/version")
    if tree.number("sys/kernel/realtime") == 1 or (version and re.search(r"PREEMPT[_ ]RT\b", version)):
        return Finding(name, "PREEMPT_RT", "good")
    if version is None:
        return Finding(
            name, "/proc/sys/kernel/version is hidden", "unknown", change="look at it yourself", command="uname -v"
        )
    model, source = _model(tree, version)
    if model is None:
        return Finding(
            name, f"{source}, which model it uses is hidden", "unknown", "much if it is none or voluntary",
            "ask as root", "sudo cat /sys/kernel/debug/sched/preempt",
        )  # fmt: skip
    found = f"{model} ({source})"
    if model in ("full", "lazy"):
        return Finding(
            name, found, "fair", "sections of the kernel with a spin lock or interrupts off delay a tick",
            "boot a PREEMPT_RT kernel", RT_KERNEL,
        )  # fmt: skip
    return Finding(
        name, found, "bad", "any call of another program into the kernel delays a tick until it ends or yields",
        "boot a PREEMPT_RT kernel"
        + ("; short of that, preempt=full on the kernel's command line" if "DYNAMIC" in version else ""),
        RT_KERNEL,
    )  # fmt: skip


def _model(tree: Tree, version: str) -> tuple[str | None, str]:
    """Preemption model of a kernel without PREEMPT_RT (None where it is hidden), and its source."""
    if "PREEMPT_DYNAMIC" not in version:
        if re.search(r"\bPREEMPT\b", version):
            return "full", "uname -v"
        return "none or voluntary", "uname -v"
    chosen = re.search(r"\((\w+)\)", tree.read("sys/kernel/debug/sched/preempt") or "")
    if chosen:
        return chosen[1], "/sys/kernel/debug/sched/preempt"
    option = tree.option("preempt")
    if option:
        return option, "PREEMPT_DYNAMIC, preempt= of the command line"
    release = tree.read("proc/sys/kernel/osrelease")
    config = tree.read("proc/config.gz") or tree.read(f"boot/config-{release}") or ""
    for line, model in (("NONE", "none"), ("VOLUNTARY", "voluntary"), ("LAZY", "lazy"), ("", "full")):
        if f"CONFIG_PREEMPT{'_' if line else ''}{line}=y" in config.splitlines():
            return model, "PREEMPT_DYNAMIC, default of its config"
    return None, "PREEMPT_DYNAMIC"


def clock_source(tree: Tree) -> Finding:
    """Check of the clock source, which decides what reading the time costs."""
    name, folder = "clock source", "sys/devices/system/clocksource/clocksource0"
    current = tree.read(f"{folder}/current_clocksource")
    if not current:
        return Finding(name, f"/{folder} is hidden", "unknown")
    if current in CLOCKS or current in SHARED_CLOCKS:
        return Finding(name, current, "good")
    usable = next((c for c in CLOCKS if c in (tree.read(f"{folder}/available_clocksource") or "").split()), None)
    return Finding(
        name, current, "bad", "every look at the clock is a system call and a slow read of a device",
        f"use {usable}" if usable else "the CPU's own counter was found unstable; dmesg says why",
        f"echo {usable} | sudo tee /{folder}/current_clocksource" if usable else "dmesg | grep -i clocksource",
    )  # fmt: skip


def throttling(tree: Tree) -> Finding:
    """Check of the CPU share that the real-time class may have."""
    name = "real-time throttling"
    runtime = tree.number("proc/sys/kernel/sched_rt_runtime_us")
    period = tree.number("proc/sys/kernel/sched_rt_period_us")
    if runtime is None or not period:
        return Finding(name, "/proc/sys/kernel/sched_rt_runtime_us is hidden", "unknown")
    if runtime < 0:
        return Finding(name, "off", "good")
    found = f"{runtime / 1000:g} ms of {period / 1000:g} ms"
    change = "allow it 95 %", "sudo sysctl -w kernel.sched_rt_period_us=1000000 kernel.sched_rt_runtime_us=950000"
    if runtime == 0:
        return Finding(name, found, "bad", "no SCHED_FIFO thread may run at all", *change)
    if runtime < 0.9 * period:
        return Finding(
            name,
            found,
            "fair",
            f"a loop that needs more than {100 * runtime / period:.0f} % of its CPU is stopped",
            *change,
        )
    return Finding(name, found, "good")
