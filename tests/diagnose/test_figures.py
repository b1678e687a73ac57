import json
from pathlib import Path

import numpy as np
import pytest

from rtctl.diagnose import figures, words
from rtctl.diagnose.case import read_case
from rtctl.diagnose.diagnosis import NAMED, NOTHING, Diagnosis, Effect, Evidence, Interval, Located, Rival
from rtctl.diagnose.kernel import OPEN
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.preflight import preflight
from rtctl.diagnose.quantities import quantities
from rtctl.diagnose.record import check, load_record
from rtctl.diagnose.simulate import Simulator
from rtctl.plants.physics import TERMS, nodes

PRACTICE = Path(__file__).resolve().parents[3] / "shared" / "blind" / "practice"
ALIKE = ("friction.stribeck", "friction.coulomb")
STICKS = TERMS["friction.stribeck"].settings(node="carriage", F_s=2.0, v_s=0.3)
CASE = {
    "format": 1, "plant": "axis", "sample_rate": 500.0, "parameters": {"M": 2.0, "F_v": 4.0, "F_c": 1.0},
    "drive": {"newton_per_volt": 10.0, "limit_volt": 10.0}, "sensors": {"x_resolution_m": 1e-6}, "delay_samples": 0.0,
    "controller": {"kind": "none"}, "controller_known": False, "reaches": {"parameter_tolerance": 0.15},
}  # fmt: skip
ALL = (
    figures.heldout_overlay, figures.missing_force, figures.polar_map, figures.spectra, figures.evidence_bars,
    figures.parameters, figures.where_map, figures.coverage, figures.turn_map,
)  # fmt: skip


@pytest.fixture(scope="module")
def found():
    """A diagnosis of an axis that sticks, recorded by the simulation itself, and its simulator."""
    t = np.arange(3000) / 500.0
    u = 0.4 * np.sin(2 * np.pi * 0.5 * t) + 0.15 * np.sin(2 * np.pi * 1.7 * t)
    case = read_case(CASE, "axis")
    columns = {"t": t, "ref": np.zeros_like(t), "w": np.zeros_like(t), "u": u, "x": 0.01 * np.sin(t)}
    model = owner_model(case)
    x = Simulator(check(columns, case)).run(model.add(STICKS), OPEN)[:, 0]
    record = check({**columns, "x": np.round(x / 1e-6) * 1e-6}, case)
    checked = preflight(record)
    effect = Effect(
        "friction.stribeck", "carriage", 0.9, {"F_s": Interval(2.0, 1.9, 2.1, "N")},
        (Rival("friction.coulomb", "carriage", 0.01, 2.0),),
    )  # fmt: skip
    evidence = [
        Evidence(("friction.stribeck:carriage",), 0.98, True),
        Evidence(("friction.coulomb:carriage",), 0.6, True),
    ]
    evidence += [
        Evidence((f"{n}:{nodes(t, 'axis')[0]}",), 0.02, False)
        for n, t in TERMS.items()
        if nodes(t, "axis") and n not in ALIKE
    ]
    d = Diagnosis(
        record, checked, NAMED, (effect,), Located("x", "carriage", "velocity", "below 0.1 m/s", 0.0, 0.8),
        {"M": Interval(2.1, 2.05, 2.15, "kg"), "F_v": Interval(3.8, 3.5, 4.1, "")}, model, model, model.add(STICKS),
        0.3, 0.001, 0.0008, tuple(evidence), 0.08, ("drive.saturation:drive",), {}, None, (100, 2250), 1.0,
    )  # fmt: skip
    return d, Simulator(record)


def texts(figure):
    """All words in a figure."""
    return " | ".join(t.get_text() for t in figure.findobj(lambda a: hasattr(a, "get_text")) if t.get_text())


def visible(figure):
    """Boxes of what is written, as drawn."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    out = []
    for ax in figure.axes:
        if ax.name == "polar":
            continue
        slanted = any(t.get_rotation() for t in ax.get_xticklabels())  # boxes of slanted words always meet
        ticks = []
        for along, axis in ((0, ax.xaxis), (1, ax.yaxis)):
            low, high = sorted(axis.get_view_interval())
            shown = [t for t in axis.get_ticklabels() if t.get_text() and low <= t.get_position()[along] <= high]
            ticks += shown if along or not slanted else []
        named = [ax.title, ax._left_title, ax.xaxis.label, ax.yaxis.label, *ticks]
        out += [(t.get_text(), t.get_window_extent(renderer)) for t in named if t.get_text()]
        if ax.get_legend() is not None:
            out.append(("legend", ax.get_legend().get_window_extent(renderer)))
    return out


@pytest.mark.parametrize("draw", ALL)
def test_every_figure_draws_within_its_frame(found, draw):
    figure = draw(*found)
    if figure is None:
        assert draw in (figures.polar_map, figures.turn_map)  # a sliding axis has no turn
        return
    figure.canvas.draw()
    width, height = figure.canvas.get_width_height()
    for text, box in visible(figure):
        assert box.x0 > -2 and box.x1 < width + 2 and box.y0 > -2 and box.y1 < height + 2, text


@pytest.mark.parametrize("draw", [f for f in ALL if f not in (figures.polar_map, figures.turn_map, figures.coverage)])
def test_no_words_lie_on_others(found, draw):
    boxes = visible(draw(*found))
    for k, (one, a) in enumerate(boxes):
        for other, b in boxes[k + 1 :]:
            both = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
            assert not (both[0] > 2 and both[1] > 2), (one, other)


def test_overlay_shows_rows_that_were_not_fitted_with_units_and_noise(found):
    d, sim = found
    figure = figures.heldout_overlay(d, sim)
    shown = texts(figure)
    assert (
        "time, s" in shown and "error, m" in shown and "before: " in shown and "after: " in shown and "noise" in shown
    )
    times = np.concatenate([line.get_xdata() for line in figure.axes[1].lines])
    assert times.min() >= d.record.t[d.fit_rows[1]]


def test_the_law_is_what_the_term_gives(found):
    d, sim = found
    missing = figures.Missing(d, sim)
    y, law, unit, what = missing.of("friction.stribeck", "carriage")
    v, along, v_unit = missing.abscissa("velocity", "carriage")
    assert (unit, v_unit, along, what) == ("N", "m/s", "speed", "missing force")
    slow = (np.abs(v) > 0.1) & (np.abs(v) < 0.25)
    slow[: d.fit_rows[0]] = False
    expected = -np.sign(v) * (STICKS.F_s - 1.0) * np.exp(-((v / STICKS.v_s) ** 2))
    assert np.median(law[slow] / expected[slow]) == pytest.approx(1.0, abs=0.2)
    assert np.median(y[slow] / law[slow]) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("slow", [1, 40])
def test_bands_cover_for_white_and_for_slow_noise(slow):
    rng = np.random.default_rng(3)
    n = 40_000
    x = 1.1 * np.sin(np.arange(n) * 0.0037) + 0.1 * np.sin(np.arange(n) * 0.0011)
    noise = 0.2 * np.repeat(rng.normal(size=n // slow), slow)
    middle, m, half, law = figures.binned(x, 2 * x + noise, 2 * x, 40, 50)
    assert 0.8 <= np.mean(np.abs(m - law) < half) <= 1.0
    assert 0.005 < np.median(half) < 0.2
    assert np.all(np.diff(middle) > 0)


def test_a_gap_in_the_axis_is_not_bridged():
    x = np.concatenate([np.linspace(0, 1, 500), np.linspace(3, 4, 500)])
    middle, *_ = figures.binned(x, x, x, 20, 5)
    hole = np.flatnonzero(np.isnan(middle))
    assert len(hole) == 1 and middle[hole[0] - 1] < 1.1 and middle[hole[0] + 1] > 2.9


def test_thinning_keeps_peaks():
    y = np.zeros(100_000)
    y[51_234] = 7.0
    t, thinned = figures.thin(np.arange(len(y)), y)
    assert len(t) == len(thinned) < 3 * figures.POINTS and thinned.max() == 7.0


def test_evidence_marks_what_was_found_and_the_null_line(found):
    d, sim = found
    figure = figures.evidence_bars(d, sim)
    shown = texts(figure)
    assert words.entry_noun("friction.stribeck:carriage", quantities(None)) in shown and "by chance: 8.0 %" in shown
    assert np.allclose(figure.axes[0].patches[0].get_width(), 98)
    brackets = [line for line in figure.axes[0].lines if len(line.get_xdata()) == 4]
    assert len(brackets) == 1 and list(brackets[0].get_ydata()) == [0, 0, 1, 1]


def test_coverage_crosses_what_cannot_be_tested(found):
    figure = figures.coverage(*found)
    crosses = [line for line in figure.axes[0].lines if line.get_marker() == "x"]
    assert len(crosses) == 1


def test_regimes_hold_rows_of_their_kind(found):
    d, sim = found
    rows = figures.regimes(d, sim)
    v = figures.speed(sim.seen, "axis", d.record.dt)
    assert np.all(v[rows["fast forwards"]] > 0) and np.all(v[rows["fast backwards"]] < 0)
    assert all(r.min() >= d.fit_rows[0] for r in rows.values())


def test_nothing_found_draws_no_law(found):
    d, sim = found
    d = d._replace(verdict=NOTHING, effects=(), located=None, after=d.before, evidence=())
    for draw in ALL:
        figure = draw(d, sim)
        if figure is not None:
            figure.canvas.draw()
            assert "law that was found" not in texts(figure) and "after" not in texts(figure).split(" | ")


@pytest.mark.parametrize(
    ("case", "name", "node"), [("case-0003", "ripple.cogging", "motor2"), ("case-0012", "ripple.encoder", "encoder")]
)
def test_practice_bundles_have_a_map_of_the_turn(case, name, node):
    if not (PRACTICE / case).exists():
        pytest.skip("no practice bundles here")
    true = json.loads((PRACTICE / "answers.json").read_text())["cases"][case]
    record = load_record(PRACTICE / case)
    owner = owner_model(record.case)
    before = owner.change(**{k: v for k, v in true["true_parameters"].items() if k in owner.base})
    sizes = {"A": 0.0018, "per_turn": 7.0} if name == "ripple.cogging" else {"A": 0.0055}
    after = before.add(TERMS[name].settings(node=node, **sizes))
    effect = Effect(name, node, 0.9, {"A": Interval(sizes["A"], 0.0, 0.01)}, ())
    n = len(record.t)
    d = Diagnosis(
        record, preflight(record), NAMED, (effect,), None, {}, owner, before, after, 0.1, 0.01, 0.001, (), 0.08, (), {},
        None, (n // 20, n * 3 // 4), 1.0,
    )  # fmt: skip
    sim = Simulator(record)
    for draw in (figures.polar_map, figures.missing_force, figures.spectra, figures.where_map):
        figure = draw(d, sim)
        figure.canvas.draw()
    y, _, _, _ = figures.Missing(d, sim).of(name, node)
    assert np.isfinite(y).all() and np.std(y) > 0


def test_the_turn_of_an_axis_that_turns_with_its_orders(found):
    d, _ = found
    t = np.arange(20000) / 500.0
    x = 2.0 * t
    case = {**CASE, "sensors": {"unit": "rad"}, "controller": {"kind": "unknown"}, "parameters": {"M": 2.0}}
    columns = {"t": t, "ref": 0 * t, "w": 0 * t, "u": 0.3 * np.cos(7 * x), "x": x}
    record = check(columns, read_case(case, "."))
    turning = d._replace(record=record, verdict=NOTHING, owner=owner_model(record.case))
    figure = figures.turn_map(turning)
    drawn = texts(figure)
    assert "missing torque, Nm" in drawn and "mean of 12 visits" in drawn and "times a turn" in drawn
    curve = figure.axes[0].lines[0]
    assert curve.get_ydata() == pytest.approx(-3.0 * np.cos(7 * np.radians(curve.get_xdata())), abs=0.1)
    boxes = visible(figure)
    width, height = figure.canvas.get_width_height()
    assert all(b.x0 > -2 and b.x1 < width + 2 and b.y0 > -2 and b.y1 < height + 2 for _, b in boxes)


def test_only_what_has_a_tolerance_has_a_grey_bar(found):
    d, _ = found
    reaches = d.record.case.reaches.model_copy(update={"parameter_tolerance": None})
    unknown = d._replace(record=d.record._replace(case=d.record.case._replace(reaches=reaches)))
    bars = [len(figures.parameters(each).axes[0].patches) for each in (d, unknown)]
    assert bars[0] == len([n for n in d.parameters if d.owner.base.get(n)]) > 0 and bars[1] == 0
