import gzip

import pytest

from rtctl.doctor import kernel

VERSION, CLOCK = "proc/sys/kernel/version", "sys/devices/system/clocksource/clocksource0"
DYNAMIC = "#1 SMP PREEMPT_DYNAMIC Debian 6.12"


@pytest.mark.parametrize(
    ("files", "verdict", "found"),
    [
        ({VERSION: "#1 SMP PREEMPT_RT Debian 6.12"}, "good", "PREEMPT_RT"),
        ({VERSION: "#1 SMP PREEMPT RT 4.19"}, "good", "PREEMPT_RT"),
        ({"sys/kernel/realtime": "1\n"}, "good", "PREEMPT_RT"),
        ({VERSION: "#1 SMP PREEMPT 5.10"}, "fair", "full"),
        ({VERSION: "#1 SMP 5.10"}, "bad", "none or voluntary"),
        ({VERSION: DYNAMIC, "sys/kernel/debug/sched/preempt": "none voluntary (full)\n"}, "fair", "full"),
        ({VERSION: DYNAMIC, "sys/kernel/debug/sched/preempt": "none (voluntary) full\n"}, "bad", "voluntary"),
        ({VERSION: DYNAMIC, "proc/cmdline": "quiet preempt=full"}, "fair", "full"),
        ({VERSION: DYNAMIC, "proc/cmdline": "quiet preempt=none"}, "bad", "none"),
        (
            {VERSION: DYNAMIC, "proc/sys/kernel/osrelease": "6.1", "boot/config-6.1": "CONFIG_PREEMPT=y\n"},
            "fair",
            "full",
        ),
        (
            {VERSION: DYNAMIC, "proc/sys/kernel/osrelease": "6.1", "boot/config-6.1": "CONFIG_PREEMPT_LAZY=y"},
            "fair",
            "lazy",
        ),
        ({VERSION: DYNAMIC}, "unknown", "hidden"),
        ({}, "unknown", "hidden"),
    ],
)
def test_preemption_finding(tree, files, verdict, found):
    said = kernel.preemption(tree(files))
    assert said.verdict == verdict
    assert found in said.found
    assert bool(said.command) == (verdict != "good")


def test_boot_option_overrides_the_default_preemption(tree, tmp_path):
    t = tree({VERSION: DYNAMIC, "proc/cmdline": "preempt=full"})
    (tmp_path / "proc/config.gz").write_bytes(gzip.compress(b"CONFIG_PREEMPT_NONE=y\n# CONFIG_PREEMPT is not set\n"))
    assert kernel.preemption(t).verdict == "fair"
    (tmp_path / "proc/cmdline").unlink()
    said = kernel.preemption(t)
    assert (said.verdict, "preempt=full" in said.change) == ("bad", True)


def test_no_preempt_remedy_for_a_kernel_without_the_option(tree):
    assert "preempt=full" not in kernel.preemption(tree({VERSION: "#1 SMP 5.10"})).change


@pytest.mark.parametrize(
    ("current", "available", "verdict", "command"),
    [
        ("tsc", "tsc kvm-clock", "good", ""),
        ("kvm-clock", "kvm-clock", "good", ""),
        ("arch_sys_counter", "arch_sys_counter", "good", ""),
        ("hpet", "tsc hpet acpi_pm", "bad", "echo tsc"),
        ("hpet", "hpet acpi_pm", "bad", "dmesg"),
    ],
)
def test_clock_source_finding(tree, current, available, verdict, command):
    files = {f"{CLOCK}/current_clocksource": f"{current}\n", f"{CLOCK}/available_clocksource": f"{available} \n"}
    said = kernel.clock_source(tree(files))
    assert (said.verdict, said.found) == (verdict, current)
    assert said.command.startswith(command)


def test_unreadable_clock_source_is_unknown(tree):
    assert kernel.clock_source(tree()).verdict == "unknown"


@pytest.mark.parametrize(
    ("runtime", "verdict"), [("-1", "good"), ("950000", "good"), ("500000", "fair"), ("0", "bad"), ("", "unknown")]
)
def test_throttling_finding(tree, runtime, verdict):
    files = {"proc/sys/kernel/sched_rt_runtime_us": runtime, "proc/sys/kernel/sched_rt_period_us": "1000000"}
    said = kernel.throttling(tree(files))
    assert said.verdict == verdict
    assert ("sysctl" in said.command) == (verdict in ("fair", "bad"))
