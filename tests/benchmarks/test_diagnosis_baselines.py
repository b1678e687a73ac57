"""Baseline methods: plain effects, exchange format, and scores as for rtctl."""

import json

import numpy as np
import pytest

from rtctl.proof.generate import generate
from rtctl.trace.bundle import load_bundle


@pytest.fixture(scope="module")
def moving(benchmark_module):
    """States of a smoothly moving axis of 10 kg, with friction (N by speed) and noise."""

    def make(friction, owner_has_dry=False, n=1500):
        t = np.linspace(0.0, 12.0, n)
        x = 0.2 * np.sin(2.1 * t) + 0.1 * np.sin(5.3 * t + 1.0)
        v, a = np.gradient(x, t), np.gradient(np.gradient(x, t), t)
        noise = 0.01 * np.random.default_rng(1).standard_normal(n)
        effort = 10.0 * a + friction(v, x)
        states = benchmark_module("baselines.states")
        return states.moving(
            states.States(
                t=t, x=x, v=v, a=a + noise, effort=effort, pull=np.abs(effort), u=effort / 35.0,
                earlier=np.roll(effort, 1),
                slope=np.gradient(effort, t), motor=None, capstan=None, has_viscous=False, has_coulomb=owner_has_dry,
                has_spring=False, reels=False,
            )
        )  # fmt: skip

    return make


def test_bic_depends_on_parameters_and_errors(benchmark_module):
    bic = benchmark_module("baselines.inverse_dynamics").bic
    assert bic(100.0, 100, 3) == pytest.approx(3 * np.log(100))
    assert bic(100.0, 100, 4) - bic(100.0, 100, 3) == pytest.approx(np.log(100))
    assert bic(50.0, 100, 3) - bic(100.0, 100, 3) == pytest.approx(-100 * np.log(2))


@pytest.mark.parametrize(
    ("friction", "names"),
    [
        (lambda v, x: 3.0 * np.sign(v), ["friction.coulomb"]),
        (lambda v, x: 4.0 * v, ["friction.viscous"]),
        (lambda v, x: 20.0 * x, ["load.spring"]),
        (lambda v, x: 1.0 + 3.0 * np.sign(v), ["friction.coulomb", "drive.offset"]),
        (lambda v, x: 0.0 * v, []),
    ],
)
def test_inverse_dynamics_names_a_plain_effect(benchmark_module, moving, friction, names):
    inverse = benchmark_module("baselines.inverse_dynamics")
    s = moving(friction)
    chosen = inverse.forward(s.a, inverse.base_columns(s), inverse.regressors(s))
    assert [r.name for r in chosen] == names


def test_effect_of_the_nominal_model_is_not_named(benchmark_module, moving):
    inverse = benchmark_module("baselines.inverse_dynamics")
    s = moving(lambda v, x: 3.0 * np.sign(v), owner_has_dry=True)
    assert "friction.coulomb" not in {r.name for r in inverse.regressors(s)}
    assert inverse.forward(s.a, inverse.base_columns(s), inverse.regressors(s)) == []


def test_every_regressor_has_rows_and_a_name_of_the_exchange_format(benchmark_module, moving):
    inverse, form = benchmark_module("baselines.inverse_dynamics"), benchmark_module("baselines.form")
    s = moving(lambda v, x: 0.0 * v)
    for r in inverse.regressors(s):
        assert r.X.shape[0] == len(s.t) and r.X.ndim == 2
        assert np.isfinite(r.X).all(), r.name
        assert r.name in form.AXES or r.name == ""


def test_backlash_operator_follows_with_its_half_width(benchmark_module):
    out = benchmark_module("baselines.inverse_dynamics").play(np.array([0.0, 1.0, 2.0, 1.8, 0.0]), 1.0)
    assert out.tolist() == [0.0, 0.5, 1.5, 1.5, 0.5]


def test_whiteness_test_separates_white_and_coloured_noise(benchmark_module):
    ljung_box = benchmark_module("baselines.whiteness").ljung_box
    e = np.random.default_rng(2).standard_normal(4000)
    assert ljung_box(e) > 0.01
    assert ljung_box(np.convolve(e, [1.0, 0.3], "valid")) < 1e-6
    assert ljung_box(np.zeros(100)) == 1.0
    p = [ljung_box(np.random.default_rng(k).standard_normal(500)) for k in range(200)]
    assert 0.35 < np.mean(p) < 0.65


def test_sparse_library_is_finite_and_contains_the_known_functions(benchmark_module, moving):
    sparse = benchmark_module("baselines.sparse")
    s = moving(lambda v, x: 3.0 * np.sign(v), owner_has_dry=True)
    functions = sparse.library(s)
    assert all(np.isfinite(f).all() and f.shape == s.t.shape for f in functions.values())
    assert sparse.known(s) <= set(functions)
    assert set(sparse.NAMES) <= {*functions, "cos(x)", "sin(x)"}


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    return generate(tmp_path_factory.mktemp("proof") / "cases", 2, 3, plants=("axis",))


def test_folder_of_cases_is_diagnosed_and_scored(benchmark_module, cases, tmp_path, capsys):
    main = benchmark_module("diagnosis_baselines").main
    assert main([str(cases), "--json", "--only", "inverse", "coulomb", "--out", str(tmp_path)]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert set(rows) == {"inverse", "coulomb"}
    assert rows["coulomb"]["cases"] == 2
    for name in rows:
        for case in ("case-0001", "case-0002"):
            said = json.loads((tmp_path / name / case / "diagnosis.json").read_text())
            assert said["verdict"] in ("named", "unnamed", "nothing")
    assert said["effects"][0]["name"] == "friction.coulomb"
    assert said["effects"][0]["node"] == "carriage"
    assert load_bundle(cases / "case-0001").case["plant"] == "axis"


def test_table_has_a_row_for_each_method(benchmark_module, cases, capsys):
    assert benchmark_module("diagnosis_baselines").main([str(cases), "--only", "coulomb", "inverse"]) == 0
    out = capsys.readouterr().out
    assert "| always Coulomb |" in out and "| inverse dynamics" in out
    rows = [line for line in out.splitlines() if line.startswith("|")]
    assert len({line.count("|") for line in rows}) == 1


def test_scores_without_answers_are_reported_as_missing(benchmark_module, tmp_path, capsys):
    assert benchmark_module("diagnosis_baselines").main([str(tmp_path)]) == 2
    assert "answers.json" in capsys.readouterr().err
