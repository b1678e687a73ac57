"""A curve in terminal characters and as a picture."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rtctl.cli import portrait
from rtctl.config.errors import UserError
from rtctl.plants.physics import TERMS


class Curve(NamedTuple):
    """Stub of the curve of plants/physics/portrait.py."""

    x: np.ndarray
    y: np.ndarray
    without: np.ndarray
    x_words: str = "speed, m/s"
    y_words: str = "drag, N"
    settings: object = TERMS["friction.viscous"].settings(node="carriage", B=46.0)
    kind: str = "axis"


X = np.linspace(-2.0, 2.0, 400)


def plot(y, without=None, braille=True):
    """Lines of a curve over X."""
    return portrait.lines(Curve(X, y, 0 * X if without is None else without), braille)


def cells(lines):
    """The part inside the axes."""
    return [line[11:].ljust(portrait.COLUMNS) for line in lines[1 : 1 + portrait.LINES]]


@pytest.mark.parametrize("braille", [True, False])
def test_drawn_curve_has_the_given_size_and_end_points(braille):
    lines = plot(X**3, braille=braille)
    assert len(lines) == portrait.LINES + 3
    assert max(map(len, lines)) <= 11 + portrait.COLUMNS
    assert lines[0].strip() == "drag, N" and "speed, m/s" in lines[-1]
    assert lines[1].split()[0] == "8" and lines[portrait.LINES].split()[0] == "-8"
    assert lines[-1].split()[0] == "-2" and lines[-1].split()[-1] == "2"


def test_plain_characters_are_ascii():
    assert "\n".join(plot(np.sin(X), braille=False)).isascii()


def test_rising_curve_goes_up_from_left_to_right():
    inside = cells(plot(X, without=X, braille=False))
    assert inside[-1][0] == "*" and inside[0][-1] == "*"
    assert inside[0][0] == " " and inside[-1][-1] == " "


def test_jump_is_drawn_as_a_connected_line():
    inside = cells(plot(np.sign(X), braille=False))
    column = [line[portrait.COLUMNS // 2] for line in inside]
    other = [line[portrait.COLUMNS // 2 - 1] for line in inside]
    assert all("*" in pair for pair in zip(column, other, strict=True))


def test_braille_dots_follow_unicode():
    cell = np.zeros((4, 2), bool)
    assert portrait.character(cell, True) == " "
    cell[0, 0] = cell[3, 1] = True
    assert portrait.character(cell, True) == "\u2881"
    assert portrait.character(cell, False) == "*"


@settings(deadline=None)
@example(scale=1.0, offset=5e-324, kind=np.zeros_like)  # the least number above 0
@given(
    scale=st.floats(1e-9, 1e9),
    offset=st.floats(-1e3, 1e3),
    kind=st.sampled_from([np.sin, np.sign, np.abs, np.zeros_like]),
)
def test_curve_of_any_scale_and_offset_fits(scale, offset, kind):
    lines = plot(scale * (kind(X) + offset))
    assert len(lines) == portrait.LINES + 3
    assert all(len(line) <= 11 + portrait.COLUMNS for line in lines[1:-1])


def test_sizes_line_names_node_and_parameters():
    assert portrait.sizes(Curve(X, X, X)) == "drawn at carriage of the axis with B 46"


def test_curve_is_saved_as_a_picture(tmp_path):
    path = tmp_path / "new" / "term.png"
    portrait.picture(Curve(X, np.sin(X), 0 * X), path)
    assert path.read_bytes().startswith(b"\x89PNG")


def test_unwritable_picture_is_an_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"term\.png cannot be written"):
        portrait.picture(Curve(X, X, X), tmp_path / "file" / "term.png")
