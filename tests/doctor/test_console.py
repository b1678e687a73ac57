import io

import pytest
from rich.console import Console

from rtctl.doctor import console
from rtctl.doctor.finding import Finding
from rtctl.doctor.measure import Measured, Rate

LONG = (
    "isolcpus=managed_irq,domain,3 nohz_full=3 rcu_nocbs=3 irqaffinity=0   in GRUB_CMDLINE_LINUX of /etc/default/grub"
)
FINDINGS = [
    Finding("SCHED_FIFO", "refused [at] 80", "bad", "any other program can delay a tick", "allow it", "rtprio 99"),
    Finding("isolated CPUs", "none", "fair", "others share the loop's CPU", "keep CPU 3 free", LONG),
    Finding("SMT", "hidden", "unknown"),
]


@pytest.fixture
def measured(lateness):
    h = lateness({15_000: 9_000, 60_000: 9, 2_000_000: 1}, late=10)
    return Measured([Rate(10_000.0, h, h)], 1, 80, 1, 5, ["no SCHED_FIFO: slow; allow it"], None)


def shown(findings, measured, width, encoding="utf-8", terminal=False):
    raw = io.BytesIO()
    file = io.TextIOWrapper(raw, encoding=encoding, errors="strict", write_through=True)
    console.show(Console(file=file, width=width, force_terminal=terminal), "bench: Linux 6.12", findings, measured)
    return raw.getvalue().decode(encoding)


@pytest.mark.parametrize("width", [30, 44, 80, 200])
def test_report_is_complete_at_any_width(measured, width):
    out = shown(FINDINGS, measured, width)
    words = " ".join(out.split())
    for text in ("bench: Linux 6.12", "This machine cannot hold 10 kHz", "10 of 9010 ticks", "no SCHED_FIFO: slow",
                 "cyclictest at 10 kHz", "What to change"):  # fmt: skip
        assert text in words
    assert LONG in out  # in one piece, for copying
    wide = [line for line in out.splitlines() if len(line) > width and LONG not in line]
    assert wide == []


def test_text_in_brackets_is_not_markup():
    assert "refused [at] 80" in shown(FINDINGS, None, 80)


def test_no_colour_without_a_terminal(measured):
    assert "\x1b" not in shown(FINDINGS, measured, 80)
    assert "\x1b[" in shown(FINDINGS, measured, 80, terminal=True)


def test_no_colour_with_the_no_color_setting(measured, monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b[3" not in shown(FINDINGS, measured, 80, terminal=True)


def test_terminal_without_block_characters_gets_ascii(measured):
    out = shown(FINDINGS, measured, 80, encoding="ascii")
    assert "#" in out


def test_missing_cyclictest_is_explained(measured):
    alone = measured._replace(
        rates=[measured.rates[0]._replace(cyclictest=None)], without="cyclictest is not installed"
    )
    out = shown(FINDINGS, alone, 80)
    assert "cyclictest is not installed" in out and "cyclictest at" not in out


def test_machine_with_nothing_to_change():
    assert "Nothing to change" in shown([Finding("SMT", "off", "good")], None, 80)


def test_no_progress_output_without_a_terminal(capsys):
    with console.progress(quiet=False) as say:
        say(0.5, "rtctl at 500 Hz")
    assert capsys.readouterr() == ("", "")
