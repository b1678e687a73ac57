"""All generated pages of the manual."""

from rtctl.manual.command_pages import command_pages
from rtctl.manual.config_pages import config_pages


def generated() -> dict[str, str]:
    """File name below docs/ -> text."""
    return {**config_pages(), **command_pages()}
