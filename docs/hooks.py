"""mkdocs: pages that are made at build time, and pages that live outside docs/."""

import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

from rtctl.manual.pages import generated

ROOT = Path(__file__).parents[1]
OUTSIDE = {  # page of the site -> file of the project
    "install_service.md": "systemd/README.md",
    "benchmarks.md": "benchmarks/README.md",
    "changes.md": "CHANGELOG.md",
}


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are not files of docs/."""
    pages = {**generated(), **{name: inward((ROOT / path).read_text()) for name, path in OUTSIDE.items()}}
    for name, text in pages.items():
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Links that leave docs/: to a page of the site where it has one, else the path as plain code."""
    return outward(markdown)


def outward(text: str) -> str:
    """Links of a page of docs/, as the site has them."""
    for name, path in OUTSIDE.items():
        text = text.replace(f"](../{path})", f"]({name})")
    return re.sub(r"\[[^\]]+\]\(\.\./([^)#]+\.(?:py|md|yaml))\)", r"`\1`", text)


def inward(text: str) -> str:
    """Links of a page outside docs/, as the site has them."""
    return re.sub(r"\]\((?:\.\./)?docs/([^)]+)\)", r"](\1)", text)
