"""Errors for people: one message that says what, where, and what would be right."""

import difflib
from collections.abc import Iterable


class UserError(Exception):
    """The user's mistake. Exit code 2."""

    exit_code = 2


class NoAnswer(Exception):  # noqa: N818
    """The data carry no answer. Exit code 3."""

    exit_code = 3


def nearest(word: str, choices: Iterable[str]) -> str | None:
    """The choice that `word` was probably meant to be, or None."""
    found = difflib.get_close_matches(word, list(choices), n=1)
    return found[0] if found else None
