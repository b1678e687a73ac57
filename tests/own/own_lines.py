"""Where something stands in a text."""


def line(text: str, part: str) -> int:
    """Number of the line that holds this part."""
    return 1 + text[: text.index(part)].count("\n")
