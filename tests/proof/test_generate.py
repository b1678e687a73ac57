"""Case generator of the plants: determinism, bundle format, shares of the kinds, visible effects."""

import itertools
import json
from collections import Counter

import numpy as np
import pyarrow.parquet as pq
import pytest

from rtctl.config.errors import UserError
from rtctl.proof import batch, draw, law, plants, seal
from rtctl.proof import generate as g
from rtctl.proof.effects import TABLE
from rtctl.proof.unknown import UNKNOWN

SECONDS = {"ivu": 8.0, "ldu": 1.8, "axis": 5.0}
WEAK = {("ldu", "timing.jitter"): 0.5}  # a jitter of 0.1 ms shows only in fast moves
NAMES = 34  # in the table of the exchange format
ALL = [(plant, name) for plant in g.PLANTS for name in draw.names_on(plant)]


@pytest.fixture(scope="module")
def machines():
    """Nominal machine of each plant over a short time, with two runs."""
    out = {}
    for plant in g.PLANTS:
        rng = np.random.default_rng([3, len(plant)])
        s = plants.BUILD[plant](rng, "rich", False, False)
        if plant == "ldu" and len(s.sensors) == 1:
            s.sensors.append("scale_counts")
        n = int(SECONDS[plant] / s.Ts)
        s.ref, s.w = s.ref[:n], s.w[:n]
        a, b = g.simulate(s, [1]), g.simulate(s, [2])
        g.measure_span(s, a)
        out[plant] = s, a, g.floors(s, a, b)
    return out


def test_every_effect_name_has_a_plant():
    assert len(TABLE) == NAMES
    assert {name for _, name in ALL} == set(TABLE)
    assert len(UNKNOWN) == 12


@pytest.mark.parametrize(("plant", "name"), ALL)
def test_effect_of_typical_size_is_visible(machines, plant, name):
    base, a, floor = machines[plant]
    want = WEAK.get((plant, name), 2.0)
    best = 0.0
    for attempt in range(3):
        for node in TABLE[name].nodes[plant]:
            s, said = g.put(base, (draw.Part(name, node, 1.0),), [7, attempt])
            run = g.simulate(s, [1])
            if run is not None:
                best = max(best, g.largest(g.visibility(s, run, a, floor)))
            assert said[0]["node"] in said[0]["nodes_ok"]
            if best > want:
                return
    assert best > want


@pytest.mark.parametrize("name", sorted(UNKNOWN))
def test_unknown_physics_is_visible(machines, name):
    plant = next(iter(UNKNOWN[name][1]))
    base, a, floor = machines[plant]
    s, _ = g.put(base, (draw.Part(name, UNKNOWN[name][1][plant][0], 1.0),), [7])
    run = g.simulate(s, [1])
    assert run is None or g.largest(g.visibility(s, run, a, floor)) > 1.5


def test_adding_an_effect_does_not_change_the_nominal_machine(machines):
    base, a, _ = machines["axis"]
    before = base.m.copy()
    g.put(base, (draw.Part("friction.stribeck", "carriage", 1.0),), [7])
    assert base.m == before
    assert np.array_equal(g.simulate(base, [1])["x"], a["x"])


@pytest.mark.parametrize("plant", g.PLANTS)
def test_effects_of_different_families_use_different_parameters(machines, plant):
    """Effects that may be drawn together change disjoint parameters of the machine."""
    s, _, _ = machines[plant]
    changed = {}
    for name in draw.names_on(plant):
        for node in TABLE[name].nodes[plant]:
            m = g.put(s, (draw.Part(name, node, 1.0),), [7])[0].m
            changed[name, node] = {
                (field, at)
                for field in m.dtype.names
                for at in zip(*np.nonzero(np.atleast_1d(m[field] != s.m[field])), strict=True)
            }
    for (one, own), (other, others) in itertools.combinations(changed.items(), 2):
        if one[0].split(".")[0] != other[0].split(".")[0]:  # effects of one family are not drawn together
            assert not own & others, (one, other)


def test_kinds_of_cases_have_their_shares():
    kinds = Counter(draw.plan(5, i, g.PLANTS).kind for i in range(200))
    assert kinds == {
        "null": 20, "parameters": 20, "decoy": 10, "single": 70, "pair": 40, "triple": 10, "unknown": 30,
    }  # fmt: skip


def test_single_cases_cover_every_effect_on_every_plant():
    met = {(p.plant, p.parts[0].name) for p in (draw.plan(5, i, g.PLANTS) for i in range(240)) if p.kind == "single"}
    assert met == set(ALL)


def test_plan_depends_only_on_seed_and_case_number():
    assert draw.plan(5, 17, g.PLANTS) == draw.plan(5, 17, g.PLANTS)
    assert [draw.plan(5, i, g.PLANTS) for i in range(20)] != [draw.plan(6, i, g.PLANTS) for i in range(20)]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("proof")
    g.generate(folder, 3, 11, ("axis",), heldout=True)
    return folder


def test_bundles_have_the_exchange_format(written):
    answers = seal.open_seal(written)
    assert sorted(answers["cases"]) == ["case-0001", "case-0002", "case-0003"]
    for name, a in answers["cases"].items():
        case = json.loads((written / name / "case.json").read_text())
        t = pq.read_table(written / name / "recording.parquet")
        assert t.column_names == ["t", "ref", "w", "u", "x"]
        assert t.num_rows == a["seconds"] * case["sample_rate"]
        assert set(a) >= {
            "kind",
            "effects",
            "ratio",
            "noise_floor",
            "true_parameters",
            "visibility",
            "size",
            "oracle_nrmse",
        }
        for key, believed in case["parameters"].items():
            assert abs(a["true_parameters"][key] / believed - 1.0) <= case["reaches"]["parameter_tolerance"]
        columns = {c: t[c].to_numpy() for c in t.column_names}
        if case["controller_known"]:
            assert np.array_equal(law.recompute(case, columns)[:, 0], columns["u"])
        held = pq.read_table(written / f"{name}-heldout" / "recording.parquet")
        assert not np.array_equal(held["ref"].to_numpy(), columns["ref"])
        assert json.loads((written / f"{name}-heldout" / "case.json").read_text()) == case


def test_equal_seeds_give_identical_recordings(written, tmp_path):
    name, answer = g.write_case(tmp_path, 11, 1, ("axis",), False)
    assert answer == seal.open_seal(written)["cases"][name]
    one, two = (pq.read_table(f / name / "recording.parquet") for f in (written, tmp_path))
    assert one.equals(two)


def test_interrupted_generation_continues_with_the_next_case(written, tmp_path):
    batch.begin(tmp_path, {"seed": 11, "plants": ["axis"], "heldout": False})
    g.write_case(tmp_path, 11, 0, ("axis",), False)
    before = (tmp_path / "case-0001" / "recording.parquet").stat().st_mtime_ns
    with pytest.raises(UserError, match="interrupted run"):
        g.generate(tmp_path, 2, 12, ("axis",))
    g.generate(tmp_path, 2, 11, ("axis",))
    assert (tmp_path / "case-0001" / "recording.parquet").stat().st_mtime_ns == before
    found = seal.open_seal(tmp_path)["cases"]
    assert found == {name: seal.open_seal(written)["cases"][name] for name in ("case-0001", "case-0002")}
    assert not (tmp_path / batch.DRAFT).exists()


def test_invalid_requests_are_refused(written, tmp_path):
    with pytest.raises(UserError, match="holds cases"):
        g.generate(written, 1, 1)
    with pytest.raises(UserError, match="not one of"):
        g.generate(tmp_path, 1, 1, ("ivu", "boat"))
    with pytest.raises(UserError, match="at least one"):
        g.generate(tmp_path, 0, 1)
