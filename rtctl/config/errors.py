"""Errors for people: one message that says what, where, and what would be right."""

import difflib
from collections.abc import Iterable


class UserError(Exception):
    """The user's mistake. Exit code 2."""

    exit_code = 2


class NoAnswer(Exception):  # noqa: N818
    """The data support no answer. Exit code 3."""

    exit_code = 3


class RunFailed(Exception):  # noqa: N818
    """A run that ended by itself; its recording is complete. Exit code 1."""

    exit_code = 1


def nearest(word: str, choices: Iterable[str]) -> str | None:
    """Choice that is closest to `word`, or None. Upper and lower case count as nearly equal."""
    names = list(choices)
    found = difflib.get_close_matches(word, names, n=1)
    if found:
        return found[0]
    folded = {name.casefold(): name for name in reversed(names)}
    found = difflib.get_close_matches(word.casefold(), folded, n=1)
    return folded[found[0]] if found else None
