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
    """The choice that `word` was probably meant to be, or None. Upper and lower case count as nearly the same."""
    names = list(choices)
    found = difflib.get_close_matches(word, names, n=1)
    if found:
        return found[0]
    folded = {name.casefold(): name for name in reversed(names)}
    found = difflib.get_close_matches(word.casefold(), folded, n=1)
    return folded[found[0]] if found else None


def did_you_mean(word: str, choices: Iterable[str], what: str = "there is") -> str:
    """The end of a message about an unknown word: '; did you mean ...?', or the choices, or nothing."""
    names = list(choices)
    near = nearest(word, names)
    if near is not None:
        return f"; did you mean '{near}'?"
    return f"; {what} {listing(names)}" if names else ""


def listing(names: Iterable[object], most: int = 20) -> str:
    """Names with commas between them, the first `most` of them."""
    words = [str(name) for name in names]
    return ", ".join(words[:most]) + (f" and {len(words) - most} more" if len(words) > most else "")
