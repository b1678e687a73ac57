"""The site builds without a warning, and every page is in its navigation."""

import os
import shutil
import subprocess
import sys

import pytest
import yaml
from manual_blocks import ROOT


def test_site_builds_without_a_warning(tmp_path):
    pytest.importorskip("material", reason="mkdocs-material is not installed: pip install 'rtctl[docs]'")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")],
        cwd=ROOT, capture_output=True, text=True, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    config = (tmp_path / "site" / "config_ivu.html").read_text()
    assert "law.position" in config and "V/rad" in config
    assert 'id="rtctl-run"' in (tmp_path / "site" / "commands.html").read_text()
    assert "0.1.0" in (tmp_path / "site" / "changes.html").read_text()
    for page in (tmp_path / "site").glob("*.html"):
        article = page.read_text().partition("<article")[2].partition("</article")[0]
        assert 'href="../' not in article, page.name
    assert "transmission.backlash" in first_of_search((tmp_path / "site" / "index.html").as_uri(), "backlash")


def first_of_search(url, words):
    """First search result of a page on disk; needs a browser."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("the rest needs a browser: apt-get install chromium")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as started:
        page = started.chromium.launch(executable_path=browser, args=["--no-sandbox"]).new_page()
        page.goto(url)
        page.locator("[data-md-component=search-query]").wait_for()
        page.locator(".md-search__form").first.click()
        page.keyboard.type(words, delay=50)
        found = page.locator(".md-search-result__item").first
        found.wait_for()
        return found.inner_text()


def test_every_page_is_in_the_navigation():
    text = (ROOT / "mkdocs.yml").read_text()
    nav = yaml.safe_load(text[text.index("nav:") :])["nav"]

    def pages(node) -> list[str]:
        if isinstance(node, str):
            return [node]
        return [page for part in (node.values() if isinstance(node, dict) else node) for page in pages(part)]

    found = pages(nav)
    assert len(found) == len(set(found))
    written = {str(path.relative_to(ROOT / "docs")) for path in (ROOT / "docs").rglob("*.md")}
    assert written <= set(found)
