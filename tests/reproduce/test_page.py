"""Page of results: thesis and measurement side by side, errata, failures, figures."""

from rtctl.reproduce import page
from rtctl.reproduce.rows import Row
from rtctl.reproduce.run import Drawn, Result

DELAY = Row("8.delay", "delay, |T| = 0 dB", "(8.2)", 3.0, "ms", 0.03, measured=3.01, law="PD", set="identified",
            filter="40 Hz", quote="hence  $|L|$	is 3")  # fmt: skip
MODE = Row("8.mode", "mode", "8.1", 2.0, "Hz", 0.5, relative=False, erratum="it is at 2.6 Hz", expected=2.55)
ERROR = Row("8.error", "error", "8.3", 9.8, "mrad", 0.1, differs="friction is the same", measured=11.6)
GAIN = Row("8.gain", "gain", "8.2", 6.2, "", 0.1, chosen="K_p from 6.2", measured=6.2)
CLAIM = Row("12.table", "share", "11.3", None, "%", bound="at least", expected=90.0, measured=96.0)


def results():
    drawn = [Drawn("8.10", "Ten.", "figure_8_10.png"), Drawn("8.3", "Three.", "figure_8_3.png")]
    return [
        Result(8, "identification", [DELAY, MODE._replace(refused="too short"), ERROR, GAIN], drawn, 1.0),
        Result(12, "tables", [CLAIM], [], 1.0),
    ]


def test_page_has_tables_by_chapter():
    text = page.text(results())
    said = " ".join(text.split())
    assert r"| `8.delay` | delay, \|T\| = 0 dB | 3 ms | 3.01 ms | 3 % | pass | (8.2) |" in text
    assert "| `8.mode` | mode | 2 Hz, erratum: 2.55 Hz | - | 0.5 Hz | **fail** | 8.1 |" in text
    assert "| `12.table` | share | (90 %) | 96 % | at least | pass | 11.3 |" in text
    assert "- `8.mode`: erratum, it is at 2.6 Hz; not measured, too short" in text
    assert text.index("## Chapter 8") < text.index("figure_8_3.png") < text.index("figure_8_10.png")
    assert text.index("figure_8_10.png") < text.index("## Chapter 12")
    assert "![Figure 8.3](images/reproduction/figure_8_3.png)\n\nFigure 8.3. Three." in text
    assert "| `8.error` | error | 9.8 mrad | 11.6 mrad | 10 % | **differs** | 8.3 |" in text
    assert "| `8.gain` | gain | 6.2 | 6.2 | 10 % | **chosen** | 8.2 |" in text
    assert r"| `8.delay` | PD | identified | 40 Hz | `hence $\|L\|$ is 3` |" in text
    assert "- `8.error`: differs, friction is the same" in text
    assert "- `8.gain`: chosen here so that the row passes: K_p from 6.2" in text
    assert "5 rows: 2 agree with the thesis, 1 by an input chosen here; 0 show an erratum" in said
    assert (
        "in 1 the emulated machine differs. The text has no number for 1 of them, only a claim. Failing: 8.mode."
        in said
    )


def test_page_is_written_into_a_folder(tmp_path):
    path = page.write(results(), tmp_path)
    assert path == tmp_path / "reproduction.md"
    assert path.read_text() == page.text(results())


def test_format_of_numbers_and_tolerances():
    assert page.value(0.000263158, "rad") == "0.000263 rad"
    assert page.value(0.0, "") == "0"
    assert page.value(63.9508, "rad/s^2/A") == "63.95 rad/s^2/A"
    assert page.tolerance(CLAIM._replace(tolerance=0.5, relative=False)) == "at least, less 0.5 %"
    assert page.tolerance(DELAY._replace(bound="at most")) == "at most, and 3 %"
    assert page.tolerance(DELAY._replace(tolerance=0.0)) == "exact"
