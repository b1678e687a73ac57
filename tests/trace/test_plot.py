import matplotlib
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.image import imread

from rtctl.trace import plot
from rtctl.trace.bundle import Bundle
from rtctl.trace.metrics import step_metrics
from rtctl.trace.plot import envelope, plot_run, summary

IVU = ("ref", "capstan", "error", "u1", "u2", "tension1_estimate", "tension2_estimate", "truth_tension1")
LDU = ("ref", "position", "error", "u", "truth_x")


def columns(names, rows=300):
    t = np.arange(rows) * 0.01
    return {"t": t, **{name: np.sin(t + k) for k, name in enumerate(names)}}


@pytest.fixture
def drawn(monkeypatch):
    """List of the saved figures."""
    figures, save = [], plot.Figure.savefig

    def keep(figure, *to, **options):
        figures.append(figure)
        save(figure, *to, **options)

    monkeypatch.setattr(plot.Figure, "savefig", keep)
    return figures


@pytest.mark.parametrize(
    ("names", "labels"),
    [
        (IVU, ["position [rad]", "error [rad]", "output [V]", "tension [N]"]),
        (LDU, ["position [m]", "error [m]", "output [V]"]),
        (("ref", "u", "x"), ["position [m]", "output [V]"]),
        (("ref", "u1", "capstan_counts"), ["position [rad]", "output [V]", "counters [counts]"]),
        (("capstan", "capstan_counts"), ["position [rad]"]),
        (("u",), ["output [V]"]),
    ],
)
def test_plot_shows_every_column_with_its_unit(tmp_path, drawn, names, labels):
    path = plot_run(columns(names), [], tmp_path / "a.png")
    assert imread(path).shape[1] == 1430
    assert [axes.get_ylabel() for axes in drawn[0].axes] == labels
    assert drawn[0].axes[-1].get_xlabel() == "time [s]"
    shown = sum(len(axes.get_legend().get_texts()) for axes in drawn[0].axes)
    assert shown == len([n for n in names if not (n == "capstan_counts" and "capstan" in names)])


def test_title_metrics_and_unit_come_from_the_bundle(tmp_path, drawn):
    t = np.arange(2000) * 0.001
    ref = np.where(t < 0.5, 0.0, np.where(t < 1.2, 1.0, 0.0))
    case = {"plant": "ivu", "recorded_at": "2024-03-01T12:30:05+00:00"}
    run = Bundle({"t": t, "ref": ref, "capstan": ref * 0.99}, case, tmp_path, {"capstan": "rad", "ref": "rad"})
    plot_run(run, step_metrics(t, ref, ref * 0.99, 12.5), tmp_path / "a.png")
    assert drawn[0]._suptitle.get_text() == "Image verification unit, 2024-03-01 12:30:05 UTC"
    assert drawn[0].axes[0].get_title(loc="left").startswith("2 steps   |   largest final error 0.125 mm")


def test_small_values_get_an_si_prefix(tmp_path, drawn):
    run = columns(("error", "u"))
    run["error"] = run["error"] * 2e-4
    plot_run(run, [], tmp_path / "a.png")
    assert drawn[0].axes[0].get_ylabel() == "error [µrad]"
    assert np.abs(drawn[0].axes[0].lines[0].get_ydata()).max() == pytest.approx(200, rel=1e-3)


def test_summary_names_the_largest_error_with_its_sign():
    step = {"final_error_mm": 0.1, "overshoot_pct": 3.0, "settling_s": 0.2}
    text = summary([step, {**step, "final_error_mm": -0.2, "settling_s": None}])
    assert "-0.2 mm" in text and "slowest settling 0.2 s" in text and "1 did not settle" in text


def test_million_rows_are_reduced_to_a_few_thousand_points(tmp_path, drawn):
    n = 1_000_000
    y = np.zeros(n)
    y[123_456] = 5.0  # one sample
    plot_run({"t": np.arange(n) * 1e-4, "u": y}, [], tmp_path / "a.png")
    line = drawn[0].axes[0].lines[0].get_ydata()
    assert len(line) <= 2 * plot.BUCKETS and line.max() == 5.0


@settings(deadline=None, max_examples=50)
@given(
    y=st.lists(st.floats(-1e6, 1e6) | st.just(float("nan")), min_size=1, max_size=300),
    buckets=st.integers(1, 60),
)
def test_envelope_covers_the_range_of_every_interval(y, buckets):
    y = np.array(y)
    t = np.arange(len(y), dtype=float)
    times, values = envelope(t, y, buckets)
    assert len(times) == len(values) <= max(len(y), 2 * buckets)
    assert (np.diff(times) >= 0).all() and times[0] == 0 and times[-1] == t[-1]
    if not np.isnan(y).all():
        assert (np.nanmin(values), np.nanmax(values)) == (np.nanmin(y), np.nanmax(y))
    else:
        assert np.isnan(values).all()


def test_falling_line_is_not_drawn_as_a_zigzag():
    t = np.linspace(0, 1, 10_000)
    _, values = envelope(t, -t, 100)
    assert (np.diff(values) <= 0).all()


def test_plot_accepts_nan_one_row_and_constants(tmp_path, recwarn):
    nothing = np.full(5, np.nan)
    plot_run({"t": np.arange(5.0), "u": nothing, "ref": np.zeros(5)}, [], tmp_path / "a.png")
    plot_run({"t": np.array([0.0]), "u": np.array([1.0])}, [], tmp_path / "b.png")
    assert [str(w.message) for w in recwarn] == []


def test_plot_keeps_the_global_state_of_matplotlib(tmp_path):
    before = dict(matplotlib.rcParams)
    plot_run(columns(IVU), [], tmp_path / "a.png")
    assert dict(matplotlib.rcParams) == before


def test_plot_without_a_clock_or_known_columns_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no column 't'"):
        plot_run({"u": np.zeros(3)}, [], tmp_path / "a.png")
    with pytest.raises(ValueError, match="none of the columns t, z is known"):
        plot_run({"t": np.zeros(3), "z": np.zeros(3)}, [], tmp_path / "a.png")
