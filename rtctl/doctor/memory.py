"""Checks of the kernel's memory management: swap, and huge pages.

Source: kernel documentation, admin-guide/mm/transhuge; swapoff(8).
"""

import re

from rtctl.doctor.finding import Finding, Tree

THP = "sys/kernel/mm/transparent_hugepage/enabled"


def swap(tree: Tree) -> Finding:
    """Check whether memory can be swapped to a disk."""
    text = tree.read("proc/swaps")
    if text is None:
        return Finding("swap", "/proc/swaps is hidden", "unknown")
    used = [line.split()[0] for line in text.splitlines()[1:] if line.strip()]
    if not used:
        return Finding("swap", "off", "good")
    return Finding(
        "swap", ", ".join(used), "fair", "supervisor and recorder can stall: only the loop's memory is locked",
        "switch it off", "sudo swapoff -a   (and take it out of /etc/fstab)",
    )  # fmt: skip


def huge_pages(tree: Tree) -> Finding:
    """Check whether the kernel joins pages of programs that did not ask for it."""
    name, chosen = "transparent huge pages", re.search(r"\[(\w+)\]", tree.read(THP) or "")
    if not chosen:
        return Finding(name, f"/{THP} is hidden", "unknown")
    if chosen[1] != "always":
        return Finding(name, chosen[1], "good")
    return Finding(
        name, "always", "fair", "khugepaged moves pages, and a tick that touches one waits for it",
        "leave it to those who ask for it", f"echo madvise | sudo tee /{THP}",
    )  # fmt: skip
