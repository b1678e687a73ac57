"""Panel on real statuses: content, and fit to any terminal."""

import pytest
from rich.cells import cell_len

from rtctl.terminal.panel import WIDEST

TRIP = {"code": "following_error", "why": "the machine is too far from its reference", "tick": 812}


@pytest.mark.parametrize("width", [1, 10, 20, 40, 60, 72, 80, 200])
def test_no_line_is_wider_than_the_terminal_at_any_width(picture, draw, width):
    lines = draw(picture.panel(trip=TRIP, mode="real", link="zmq", left=7.0, lacks=["no right to SCHED_FIFO"]), width)
    assert max(cell_len(line.rstrip()) for line in lines) <= min(width, WIDEST)


def test_panel_of_forty_columns_keeps_the_most_important_parts(picture, draw):
    lines = draw(picture.panel(left=7.0), 40)
    assert "running" in lines[0] and "7 s left" in lines[0]
    assert "Hz" not in lines[0]  # less important
    table = [line for line in lines if line.startswith(("capstan", "position"))]
    assert len(table) == 1
    assert table[0].split()[-1] in ("rad", "mm")
    assert len(table[0].split()) == 4  # measured and error
    assert not any("[" in line for line in lines)  # no bars
    assert any(line.startswith("ticks") and "0 missed" in line for line in lines)


def test_wide_panel_shows_reference_limits_and_bars(picture, draw):
    lines = draw(picture.panel(), 100)
    heads = next(line for line in lines if "measured" in line)
    assert "reference" in heads and "error" in heads
    for line in lines:
        if line.startswith("u"):
            assert "±" in line and "[" in line and line.endswith("]")
    values = next(line for line in lines if line.startswith(("capstan", "position"))).split()
    measured, reference, error = map(float, values[1:4])
    assert reference - measured == pytest.approx(error, abs=2e-4)


def test_panel_numbers_are_those_of_the_status(picture, draw):
    s = picture.status["signals"]
    text = "\n".join(draw(picture.panel(), 100))
    if "capstan" in s:
        assert f"{s['capstan']:+.4f}" in text and f"{s['u1']:+.3f}" in text and f"{s['tension1_estimate']:+.3f}" in text
    else:
        assert f"{1000 * s['position']:+.4f}" in text and "mm" in text
    assert f"of {picture.status['ticks']}" in text
    assert f"peak {1000 ** ('capstan' not in s) * picture.traces.error.peak:.4g}" in text


@pytest.mark.parametrize("width", [30, 40, 120])
def test_panel_shows_the_full_cause_of_a_trip(picture, draw, width):
    lines = draw(picture.panel(state="tripped", trip=TRIP), width)
    assert "tripped at tick 812, following_error: the machine is too far from its reference" in " ".join(
        line.strip() for line in lines
    )


def test_low_terminal_keeps_state_trip_and_signals(picture, draw):
    lines = draw(picture.panel(state="tripped", trip=TRIP, lacks=["memory"]), 100, height=6)
    assert len(lines) == 5
    assert "tripped" in lines[0] and "tick 812" in lines[1]
    assert not any("memory" in line or "tick time" in line for line in lines)


def test_panel_always_shows_lost_rows_and_a_full_disk(picture, draw):
    rows = {"lost_in_ring": 3, "recorded": 10, "queued": 0, "lost": 4, "error": "No space left on device"}
    lines = draw(picture.panel(rows=rows), 80, height=9)
    assert any("7 lost" in line and "No space left on device" in line for line in lines)


def test_lateness_is_shown_in_real_mode_only(picture, draw):
    assert not any("lateness" in line for line in draw(picture.panel(), 100))
    late = {"p50": 12.0, "p99": 20.0, "p999": 55.0, "max": 1234.0}
    lines = draw(picture.panel(mode="real", lateness_us=late), 100)
    assert sum(line.startswith("lateness") for line in lines) == 2
    assert any("max 1234 us" in line for line in lines)


def test_first_line_shows_a_lost_daemon(picture, draw):
    assert "ivu has ended" in draw(picture.panel(gone="ivu has ended; waiting"), 60)[0]


def test_panel_is_ascii_on_an_ascii_terminal(picture, draw):
    text = "".join(draw(picture.panel(left=1.0, trip=TRIP), 100, encoding="ascii"))
    assert text.isascii()
    assert "+-" in text and "@" in text


def test_no_color_setting_removes_all_colours(picture, draw, monkeypatch):
    panel = picture.panel(state="tripped", trip=TRIP)
    assert "\x1b[1;31m" in "".join(draw(panel, 80, color_system="standard"))
    monkeypatch.setenv("NO_COLOR", "1")
    text = "".join(draw(panel, 80, color_system="standard"))
    assert not any(f"\x1b[{code}" in text for code in ("31", "1;31", "37", "41", "1;37"))
    assert " tripped " in text


def test_output_at_its_limit_is_marked(picture, draw):
    high = picture.law["limit"]["high"]
    signals = {**picture.status["signals"], "u": high, "u1": high}
    text = "".join(draw(picture.panel(signals=signals), 100, color_system="standard"))
    assert "\x1b[31m" in text
    line = next(row for row in draw(picture.panel(signals=signals), 100) if row.startswith("u"))
    assert line.endswith("█]")
