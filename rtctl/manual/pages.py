"""All pages of the manual that are made and not written."""

from rtctl.manual.command_pages import command_pages
from rtctl.manual.config_pages import config_pages


def generated() -> dict[str, str]:
    """File name below docs/ -> text."""
    return {**config_pages(), **command_pages()}
