import re
from html.parser import HTMLParser
from io import StringIO

import numpy as np
import pytest
import yaml
from rich.console import Console

from rtctl.diagnose import report
from rtctl.diagnose.case import read_case
from rtctl.diagnose.diagnosis import (
    AMBIGUOUS,
    NAMED,
    NOTHING,
    UNNAMED,
    Diagnosis,
    Effect,
    Evidence,
    Interval,
    Located,
    Rival,
)
from rtctl.diagnose.kernel import OPEN
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.preflight import preflight
from rtctl.diagnose.record import check
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.words import verdict_sentences
from rtctl.plants.physics import TERMS

VOID = {"meta", "br", "img", "hr", "link", "input"}
CASE = {
    "format": 1, "plant": "axis", "sample_rate": 500.0, "parameters": {"M": 2.0, "F_v": 4.0, "F_c": 1.0},
    "drive": {"newton_per_volt": 10.0, "limit_volt": 10.0}, "sensors": {"x_resolution_m": 1e-6}, "delay_samples": 0.0,
    "controller": {"kind": "none"}, "controller_known": False, "reaches": {"parameter_tolerance": 0.15},
}  # fmt: skip
STICKS = Effect(
    "friction.stribeck", "carriage", 0.9, {"F_s": Interval(2.0, 1.93, 2.07, "N"), "v_s": Interval(0.3, 0.28, 0.32)},
    (Rival("friction.load", "carriage", 0.012, 2.5),),
)  # fmt: skip
DRAGS = Effect("friction.asymmetry", "carriage", 0.5, {"a": Interval(0.2, 0.1, 0.3)}, ())


@pytest.fixture(scope="module")
def named():
    """A diagnosis of an axis that sticks, recorded by the simulation itself."""
    t = np.arange(2500) / 500.0
    u = 0.4 * np.sin(2 * np.pi * 0.5 * t) + 0.15 * np.sin(2 * np.pi * 1.7 * t)
    case = read_case(CASE, "axis")
    columns = {"t": t, "ref": np.zeros_like(t), "w": np.zeros_like(t), "u": u, "x": 0.01 * np.sin(t)}
    model = owner_model(case)
    after = model.add(TERMS["friction.stribeck"].settings(node="carriage", F_s=2.0, v_s=0.3))
    x = Simulator(check(columns, case)).run(after, OPEN)[:, 0]
    record = check({**columns, "x": np.round(x / 1e-6) * 1e-6}, case)
    evidence = (Evidence(("friction.stribeck:carriage",), 0.98, True), Evidence(("drive.offset:drive",), 0.02, False))
    return Diagnosis(
        record, preflight(record), NAMED, (STICKS,),
        Located("x", "carriage", "velocity", "below 0.1 m/s", 0.5, 0.8),
        {"M": Interval(2.125, 2.05, 2.2, "kg"), "F_v": Interval(3.8, 3.5, 4.1)}, model, model,
        after, 0.3, 0.001, 0.0008, evidence, 0.08,
        ("drive.saturation:drive", "friction.load:carriage"), {}, None, (100, 1875), 1.0,
    )  # fmt: skip


def variants(d: Diagnosis) -> dict[str, Diagnosis]:
    """The same record with every verdict."""
    hides = {"friction.coulomb:carriage": Interval(0.031, 0.031, 0.031, "N")}
    plan = {"campaign": {"name": "slow_reversals", "amplitude": np.float64(0.02), "runs": (1, 2)}}
    return {
        NAMED: d,
        "several": d._replace(effects=(STICKS, DRAGS)),
        AMBIGUOUS: d._replace(verdict=AMBIGUOUS, effects=(STICKS, DRAGS), experiment=plan),
        UNNAMED: d._replace(verdict=UNNAMED, effects=(), after=d.before, heldout_after=0.3),
        NOTHING: d._replace(
            verdict=NOTHING, effects=(), located=None, after=d.before, evidence=(), hides=hides, cannot_test=()
        ),
    }


@pytest.fixture(scope="module")
def pages(named):
    """HTML of every verdict."""
    return {name: report.html(d) for name, d in variants(named).items()}


class Strict(HTMLParser):
    """Collects what is wrong with a page, and what is in it."""

    def __init__(self):
        super().__init__()
        self.open, self.wrong, self.ids, self.words, self.tags = [], [], [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids += [v for k, v in attrs if k == "id"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids += [v for k, v in attrs if k == "id"]

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style", "script"):
            self.words.append(data)


def parse(page: str) -> Strict:
    parser = Strict()
    parser.feed(page)
    parser.close()
    return parser


KINDS = [NAMED, "several", AMBIGUOUS, UNNAMED, NOTHING]


@pytest.mark.parametrize("kind", KINDS)
def test_html_is_well_formed(pages, kind):
    page = parse(pages[kind])
    assert page.wrong == [] and page.open == []
    assert len(page.ids) == len(set(page.ids))
    assert len(pages[kind]) < 3e6


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_points_outside(pages, kind):
    page = pages[kind]
    assert not re.search(r"https?:|//[a-z]|@import|<script|<link", re.sub(r"base64,[^\"]*", "", page))
    ids = set(parse(page).ids)
    assert set(re.findall(r"url\(#([^)]*)\)", page)) | set(re.findall(r'href="#([^"]*)"', page)) <= ids


@pytest.mark.parametrize("kind", KINDS)
def test_the_verdict_stands_in_the_page(pages, named, kind):
    shown = " ".join(" ".join(parse(pages[kind]).words).split())
    assert verdict_sentences(variants(named)[kind]) in shown


@pytest.mark.parametrize("kind", KINDS)
def test_every_figure_has_an_alternative_text(pages, kind):
    page = parse(pages[kind])
    pictures = [attrs for tag, attrs in page.tags if tag == "svg"]
    assert len(pictures) >= 6
    assert all(a["role"] == "img" and a["aria-labelledby"] in page.ids for a in pictures)
    titles = re.findall(r'<title id="[a-z]+-alt">([^<]+)</title>', pages[kind])
    assert len(titles) == len(pictures) and all(len(t) > 30 for t in titles)


def test_ink_is_the_pages_own_colour(pages):
    from rtctl.diagnose.figures import INK

    assert INK not in pages[NAMED].partition("<body>")[2] and "currentColor" in pages[NAMED]
    assert "prefers-color-scheme: dark" in pages[NAMED] and "@media print" in pages[NAMED]
    assert 'name="viewport"' in pages[NAMED]


def test_numbers_of_effect_parameters_and_rivals(pages):
    shown = " ".join(parse(pages[NAMED]).words)
    for text in ("F_s = 2.00 N", "1.93 to 2.07", "90 %", "2.125", "2.05 to 2.2", "0.012", "2.5", "p-value"):
        assert text in shown, text


def test_what_cannot_be_shown_is_listed(pages):
    assert "This record cannot show a lower limit at the drive: that takes commands near the limit." in pages[NAMED]
    assert "Every effect of the library could have been seen." in pages[NOTHING]


def test_nothing_lists_smallest_sizes(pages):
    assert "31 mN" in pages[NOTHING]


def test_ambiguous_brings_a_campaign_that_reads_back(pages):
    code = re.search(r"<pre><code>(.*?)</code></pre>", pages[AMBIGUOUS], re.S)
    assert code is not None
    campaign = yaml.safe_load(code[1].replace("&#39;", "'"))
    assert campaign == {"campaign": {"name": "slow_reversals", "amplitude": 0.02, "runs": [1, 2]}}
    assert "Run this next" not in pages[NAMED].partition("</style>")[2].replace("Run this next: ", "")


def test_a_designed_experiment_is_told_and_drawn_instead_of_listed(named):
    plan = {
        "name": "dither", "words": "Move slowly there and back.", "why": {
            "words": "It tells one from the other.", "distance": {"dither": 0.5, "slow_ramp": 1.5},
            "refused": {"warm_up": "hot"},
        },
        "reference": {"unit": "m", "knots": [[0.0, 0.0], [1.25, 0.0123], [2.5, 0.0]], "repeat": 2.5, "relative": True},
        "seconds": 12.0, "limits": {"travel": [-0.01, 0.03]}, "file": "experiment.yaml",
    }  # fmt: skip
    rival = DRAGS._replace(instead_of="friction.stribeck:carriage")
    page = parse(report.html(named._replace(verdict=AMBIGUOUS, effects=(STICKS, rival), experiment=plan)))
    shown = " ".join(" ".join(page.words).split())
    assert "Run this next: move slowly there and back." in shown and "Move slowly there and back." in shown
    assert "It tells one from the other." in shown and "with room of -10 to 30 mm around it" in shown
    assert "rtctl run experiment.yaml --for 12s" in shown and "left out: hot" in shown
    assert "0.0123" not in shown and "knots" not in shown
    assert "motion-alt" in page.ids and shown.index("slow ramp") < shown.index("dither")


def test_where_it_is_does_not_say_the_axis_twice(named):
    at = Located("x", "carriage", "velocity", "velocity -0.1 to 0.1", 0.5, 0.8)
    assert report.located(named._replace(located=at)) == (
        "The position shows it from 500 ms on. "
        "Of the error 80 % comes from the carriage; it goes with velocity, -0.1 to 0.1."
    )


def test_text_from_the_owner_is_escaped(named):
    case = named.record.case._replace(warnings=("<b>bold</b> & more",))
    page = report.html(named._replace(record=named.record._replace(case=case)))
    assert "&lt;b&gt;bold&lt;/b&gt; &amp; more" in page and "<b>bold" not in page


def test_write_makes_the_folder_and_the_same_file_each_time(named, tmp_path):
    path = report.write(named, tmp_path / "a" / "b")
    assert path == tmp_path / "a" / "b" / "report.html"
    assert path.read_text() == report.write(named, tmp_path).read_text()


@pytest.mark.parametrize("kind", KINDS)
def test_terminal(named, kind):
    d = variants(named)[kind]
    out = StringIO()
    Console(file=out, width=200).print(report.terminal(d))
    text = " ".join(out.getvalue().split())
    assert d.verdict in text and verdict_sentences(d) in text
    assert ("F_s = 2.00 N" in text) == bool(d.effects)
    assert ("2 effects cannot be tested" in text) == (kind != NOTHING)


def test_terminal_fits_a_narrow_window(named):
    out = StringIO()
    Console(file=out, width=60).print(report.terminal(named))
    assert max(map(len, out.getvalue().splitlines())) <= 60


@pytest.mark.parametrize(
    ("v", "unit", "text"),
    [
        (Interval(0.0031, 0.003, 0.0032), "Nm", ("3.10 mNm", "3.00 to 3.20")),
        (Interval(0.2, -0.3, 0.7), "", ("0.20", "-0.30 to 0.70")),
        (Interval(1.0, 0.5, np.inf), "V", ("1.0 V", "0.50 to -")),
    ],
)
def test_intervals_share_a_unit(v, unit, text):
    assert report.interval(v, unit) == text
