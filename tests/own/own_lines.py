"""Line numbers in a text."""


def line(text: str, part: str) -> int:
    """Number of the line with the given part."""
    return 1 + text[: text.index(part)].count("\n")
