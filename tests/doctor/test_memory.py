import pytest

from rtctl.doctor import memory

HEAD = "Filename\t\t\t\tType\t\tSize\n"


@pytest.mark.parametrize(
    ("files", "verdict", "found"),
    [
        ({"proc/swaps": HEAD}, "good", "off"),
        ({"proc/swaps": f"{HEAD}/dev/sda2 partition 100\n/swapfile file 7\n"}, "fair", "/dev/sda2, /swapfile"),
        ({}, "unknown", "hidden"),
    ],
)
def test_swap_finding(tree, files, verdict, found):
    said = memory.swap(tree(files))
    assert (said.verdict, found in said.found) == (verdict, True)
    assert ("swapoff" in said.command) == (verdict == "fair")


@pytest.mark.parametrize(
    ("text", "verdict"),
    [
        ("always [madvise] never\n", "good"),
        ("always madvise [never]\n", "good"),
        ("[always] madvise never\n", "fair"),
        (None, "unknown"),
    ],
)
def test_huge_pages_finding(tree, text, verdict):
    said = memory.huge_pages(tree({memory.THP: text} if text else {}))
    assert said.verdict == verdict
    assert ("echo madvise" in said.command) == (verdict == "fair")
