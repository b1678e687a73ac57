"""Tuning: margins on the model, a run, reasons in the config, and refused requirements."""

import filters
import fused
import numpy as np
import pytest
import yaml

from rtctl import machines
from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import load_settings
from rtctl.design import figures, margins, robustness, shaping, tune
from rtctl.laws.sections import SectionsSettings
from rtctl.trace import plot


@pytest.fixture(scope="module")
def ivu() -> tune.Tuned:
    return tune.tune(fused.config("ivu", "steps"))


@pytest.fixture(scope="module")
def ldu() -> tune.Tuned:
    law = SectionsSettings.model_validate(filters.FIFTY_HERTZ)
    config = fused.config("ldu", "print_steps")
    with pytest.MonkeyPatch.context() as patch:
        found = shaping.Shaped(law, margins.of_config(shaping.applied(config, law)))
        patch.setattr(shaping, "design", lambda config, limits: found)
        return tune.tune(config)


def test_reel_unit_gets_a_gain_schedule(ivu):
    assert ivu.config.law.gain_schedule.mode == "margin"
    assert ivu.config.law.position.gain == pytest.approx(30.8, rel=0.01)
    for R1, R2 in ((0.04, 0.04), (0.02, 0.04)):
        m = robustness.at(ivu.config, R1, R2)
        assert m.stable and m.GM >= 6 and m.PM >= 45
    assert set(ivu.maps) == {"fixed gain", "scheduled"}


def test_reel_unit_runs_with_its_gain_schedule(ivu):
    run = fused.run(ivu.config, 4.4)
    assert not run.tripped
    end = run.between(3.7, 3.95)
    assert np.abs(end["truth_capstan"] - 1.0).max() < 0.01


def test_linear_drive_gets_filters(ldu):
    assert [section.kind for section in ldu.config.law.position.sections] == ["lead_lag", "notch", "notch", "low_pass"]
    assert ldu.before.bandwidth < 10 < 50 <= ldu.after.bandwidth
    assert ldu.after.GM >= 11 > ldu.before.GM and ldu.after.PM >= 60


def test_axis_gets_a_pd():
    found = tune.tune(fused.config("axis"), bandwidth=3.0)
    assert found.config.law.position.kind == "pd"
    assert found.config.law.position.tau_d == pytest.approx(1 / (3 * np.pi), rel=1e-3)
    assert found.after.stable and found.after.PM > 60


@pytest.mark.parametrize("name", ["ivu", "ldu"])
def test_written_config_loads_unchanged_and_contains_the_reasons(name, request, tmp_path):
    found = request.getfixturevalue(name)
    text = tune.written(found, "tuned")
    path = tmp_path / "tuned.yaml"
    path.write_text(text)
    again = load_settings(path, machines.CONFIGS[name])
    assert again == found.config
    lines = [line.strip() for line in text.splitlines()]
    assert lines[0] == "# tuned"
    for reason in found.reasons:
        i = lines.index(f"# {reason.words}")
        after = next(line for line in lines[i + 1 :] if not line.startswith("#"))
        key = "kind" if reason.path.endswith("kind") else reason.path.rpartition(".")[2]
        assert after.removeprefix("- ").startswith(f"{key}:")
    assert yaml.safe_load(text)["machine"] == name


def test_unstable_loop_is_refused_as_a_start():
    with pytest.raises(NoAnswer, match=r"the loop of ivu is unstable at 26\.\d Hz; its gain is 4\.\d dB too high"):
        tune.tune(fused.config("ivu", law__position__gain=120.0))


def test_unreachable_margins_are_refused():
    with pytest.raises(NoAnswer, match=r"no factor keeps 35 dB and 45 deg at \d+/\d+ mm"):
        tune.tune(fused.config("ivu"), GM=35.0)


@pytest.mark.parametrize(("wish", "words"), [
    ({"bandwidth": 0.0}, "--bandwidth 0"), ({"bandwidth": 60.0}, "a tenth of the rate, 50 Hz"),
    ({"damping": 0.0}, "--damping"), ({"GM": -1.0}, "--gm"), ({"PM": 120.0}, "--pm"),
])  # fmt: skip
def test_invalid_requirements_are_refused(wish, words):
    with pytest.raises(UserError, match=words):
        tune.tune(fused.config("ivu"), **wish)


def test_picture_shows_the_loops_and_their_margins(ldu, tmp_path):
    figure = figures.loops({"before": fused.config("ldu"), "after": ldu.config})
    plot.save(figure, tmp_path / "loop.png")
    assert (tmp_path / "loop.png").stat().st_size > 20_000
    gain, nyquist, phase, closed, step = figure.axes
    assert len(gain.lines) == 3 and len(step.lines) == 2
    y = step.lines[1].get_ydata()
    assert y[-1] == pytest.approx(1.0, abs=0.03)
    assert nyquist.get_aspect() == 1.0 and phase.get_ylim() == (-450, 0) and closed.get_xscale() == "log"
    assert f"GM {ldu.after.GM:.1f} dB" in figure.get_suptitle()


def test_picture_of_the_radius_map(ivu, tmp_path):
    figure = figures.radii(ivu.maps)
    assert len(figure.axes) == 4
    assert "scheduled: at least" in figure.axes[1].get_title()
    with pytest.raises(UserError, match="cannot be written"):
        plot.save(figure, tmp_path / "nowhere" / "map.png")


def test_unstable_loop_is_drawn_without_a_step_response():
    figure = figures.loops({"now": fused.config("ivu", law__position__gain=120.0)})
    assert not figure.axes[-1].lines
    assert not margins.of_config(fused.config("ivu", law__position__gain=120.0)).stable


def test_requested_limits_are_passed_to_the_design(monkeypatch):
    seen = {}

    def design(config, limits):
        seen["limits"] = limits
        raise NoAnswer("enough")

    monkeypatch.setattr(shaping, "design", design)
    with pytest.raises(NoAnswer, match="enough"):
        tune.tune(fused.config("ldu"), bandwidth=30.0, GM=9.0, PM=50.0)
    assert (seen["limits"].bandwidth, seen["limits"].GM, seen["limits"].PM) == (30.0, 9.0, 50.0)
