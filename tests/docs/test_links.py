"""Links and pictures of the manual: existing files, generated pages and headings."""

import re
from pathlib import Path

import pytest
from manual_blocks import PAGES, ROOT, prose

from rtctl.manual.pages import generated

LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
MADE = generated()


def slugs(text: str) -> set[str]:
    """Anchors of the headings of a page, as in mkdocs."""
    found = set()
    for heading in re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), re.M):
        named = re.search(r"\{ #([\w-]+) \}", heading)
        plain = re.sub(r"[^\w\s-]", "", heading).strip().lower()
        found.add(named[1] if named else re.sub(r"[-\s]+", "-", plain))
    return found


def broken(page: Path, text: str) -> list[str]:
    """Broken links of a page."""
    wrong = []
    for target in LINK.findall(prose(text)):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = (ROOT / page).parent / path if path else ROOT / page
        made = file.name if file.parent == ROOT / "docs" and file.name in MADE else None
        if made is None and not file.exists():
            wrong.append(f"{target}: no such file")
        elif anchor:
            there = MADE[made] if made is not None else text if not path else file.read_text()
            if anchor not in slugs(there):
                wrong.append(f"{target}: no such heading")
    return wrong


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_links_of_the_manual_exist(page):
    assert broken(page, (ROOT / page).read_text()) == []


@pytest.mark.parametrize("name", MADE)
def test_links_of_generated_pages_exist(name):
    assert broken(Path("docs") / name, MADE[name]) == []


def test_broken_link_is_found():
    page = Path("docs/index.md")
    assert broken(page, "[a](nowhere.md) `[b](not_a_link.md)` ![c](images/none.png) [d](commands.md#rtctl-run)") == [
        "nowhere.md: no such file",
        "images/none.png: no such file",
    ]
    assert broken(page, "[a](commands.md#rtctl-jump)") == ["commands.md#rtctl-jump: no such heading"]
