"""Concealed cases of described machines: determinism, format, shares of the kinds, visible effects, scores."""

import importlib.util
import json
from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from rtctl.config.errors import UserError
from rtctl.proof import seal
from rtctl.proof.machines import build, describe, draw
from rtctl.proof.machines import generate as g
from rtctl.proof.machines import simulate as sim
from rtctl.proof.machines.effect import TABLE, UnfitError, measure
from rtctl.proof.machines.unknown import UNKNOWN
from rtctl.proof.score import score

SHARED = Path(__file__).parents[4] / "shared" / "machines"
NAMES = 38  # effects in the tables of the exchange format that a described machine may have
NEED_MORE = ("structure.compliance", "sensor.rectified", "sensor.scale")  # a rigid joint, a second reading


@pytest.fixture(scope="module")
def measured(machines):
    """Nominal machines with their runs and noise floors."""
    out = {}
    for name, (s, run) in machines.items():
        measure(s, run)
        out[name] = s, run, sim.floors(s, run, sim.simulate(s, [2]))
    return out


@pytest.mark.parametrize("name", sorted({*TABLE, *UNKNOWN} - {*NEED_MORE}))
def test_effect_is_visible_on_at_least_one_machine(measured, name):
    p = draw.Plan("single", 1.0, (name,), (), "rich", None)
    best = 0.0
    for base, run, floor in measured.values():
        try:
            s, said = g.put(base, p, [7], 1.0)
        except UnfitError:
            continue
        changed = sim.simulate(s, [1])
        if changed is None:
            continue
        assert said[0]["node"] in said[0]["nodes_ok"] and name in said[0]["names_ok"]
        best = max(best, sim.largest(sim.visibility(s, changed, run, floor)))
        if best > 2.0:
            return
    assert best > 2.0


@pytest.mark.parametrize("name", NEED_MORE)
def test_effect_that_needs_a_special_machine_is_visible(name):
    p = draw.Plan("single", 1.0, (name,), ("belt",), "rich", None)
    need = draw.needs(p)
    for seed in range(8):
        base = build.sound("belt", np.random.default_rng([5, seed]), "rich", need, False)
        n = int(2.0 / base.Ts)
        base.ref, base.w, base.settle = base.ref[:n], base.w[:n], n // 4
        run, other = sim.simulate(base, [1]), sim.simulate(base, [2])
        if not sim.healthy(base, run):
            continue
        measure(base, run)
        s, _ = g.put(base, p, [7], 1.0)
        changed = sim.simulate(s, [1])
        if changed is not None:
            assert sim.largest(sim.visibility(s, changed, run, sim.floors(base, run, other))) > 2.0
            return
    raise AssertionError("no belt whose loop holds")


def test_adding_an_effect_does_not_change_the_nominal_machine(measured):
    base, run, _ = measured["belt"]
    before = base.m.copy()
    g.put(base, draw.Plan("single", 1.0, ("structure.resonance",), (), "rich", None), [7], 1.0)
    assert base.m == before
    column = base.columns[0][0]
    assert np.array_equal(sim.simulate(base, [1])[column], run[column])


def test_plans_have_their_shares_of_kinds_and_cover_all_effects():
    plans = [draw.plan(5, i) for i in range(120)]
    assert Counter(p.kind for p in plans) == {
        "single": 54, "null": 14, "parameters": 10, "decoy": 6, "pair": 18, "unknown": 18,
    }  # fmt: skip
    assert len(TABLE) == NAMES
    assert {n for p in plans if p.kind == "single" for n in p.names} == set(TABLE)
    assert {n for p in plans if p.kind == "unknown" for n in p.names} == set(UNKNOWN)
    assert set(Counter(p.topologies[0] for p in plans).values()) == {12}
    assert draw.plan(5, 17) == draw.plan(5, 17) != draw.plan(6, 17)


def test_nominal_values_are_within_the_tolerances_of_the_true_values():
    s = build.sound("arm", np.random.default_rng(4), "rich", frozenset(), True)
    tolerance = s.case["tolerance"]
    owner = dict(describe.numbers(s.case["machine"]))
    for path, true in describe.numbers(s.machine):
        share = tolerance.get(path, tolerance["default"] if not path.endswith(("dac_bits", "dac_range")) else 0.0)
        assert abs(true - owner[path]) <= share * abs(owner[path]) * 1.001, path
    wrong = [abs(s.truth[p] / owner[p] - 1.0) / tolerance.get(p, tolerance["default"]) for p in s.truth]
    assert min(wrong) > 0.75  # every parameter error is near its tolerance


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("machines")
    kinds = [draw.plan(292, i, ("axis", "spindle")).kind for i in range(2)]
    g.generate(folder, 2, 292, ("axis", "spindle"))
    return folder, kinds


def test_bundles_have_format_2(written):
    folder, kinds = written
    answers = seal.open_seal(folder)
    assert answers["format"] == 2 and answers["mix"] == "proof of machines, seed 292"
    for i, (name, a) in enumerate(sorted(answers["cases"].items())):
        case = json.loads((folder / name / "case.json").read_text())
        table = pq.read_table(folder / name / "recording.parquet")
        machine = case["machine"]
        parts = [*machine["drives"].values(), *machine["sensors"].values()]
        loop = [] if a["open_loop"] else ["ref", "w"]
        assert table.column_names == ["t", *loop, *(part["column"] for part in parts)]
        assert table.num_rows == pytest.approx(a["seconds"] * case["sample_rate"])
        assert set(machine) == {"bodies", "joints", "drives", "sensors"}
        assert a["kind"] == kinds[i] and a["plant"] == a["topology"] in ("axis", "spindle")
        for part in parts:
            if "counts_per_unit" in part:
                assert table[part["column"]].type == "int32"


def test_equal_seeds_give_identical_bytes(written, tmp_path):
    folder, _ = written
    g.write_case(tmp_path, 292, 1, ("spindle", "axis"), False)
    again = json.loads((tmp_path / g.DRAFT / "case-0002.json").read_text())
    assert again == seal.open_seal(folder)["cases"]["case-0002"]
    for file in ("recording.parquet", "case.json"):
        assert (tmp_path / "case-0002" / file).read_bytes() == (folder / "case-0002" / file).read_bytes()


def test_invalid_requests_are_refused(written, tmp_path):
    with pytest.raises(UserError, match="holds cases"):
        g.generate(written[0], 1, 1)
    with pytest.raises(UserError, match="not one of"):
        g.generate(tmp_path, 1, 1, ("belt", "boat"))
    with pytest.raises(UserError, match="at least one"):
        g.generate(tmp_path, 0, 1)


def oracle(a, twin=False):
    """The correct diagnosis; with `twin` under an equivalent name of the effect."""
    if a["kind"] == "unknown":
        return {"verdict": "unnamed", "effects": [], "located": {"node": a["effects"][0]["node"], "axis": "time"}}
    if not a["effects"]:
        return {"verdict": "nothing", "effects": []}
    names = [e["names_ok"][-1] if twin else e["name"] for e in a["effects"]]
    effects = [{"name": n, "node": e["node"], "confidence": 1.0} for n, e in zip(names, a["effects"], strict=True)]
    return {"verdict": "named", "effects": effects, "located": {"axis": (a["effects"][0]["axes_ok"] or ["time"])[0]}}


def answers_of_all_kinds():
    """Answers in the format of the generator, without simulation; gravity and offset are equivalent names."""
    twins = {"load.gravity", "drive.offset"}
    held = {"single": ["load.gravity"], "pair": ["drive.offset", "friction.stribeck"], "unknown": ["unknown.x"]}
    cases = {}
    for i, (kind, size) in enumerate(draw.DECK):
        effects = [
            {
                "name": name,
                "names_ok": sorted({name, *(twins if name in twins else ())}),
                "node": "carriage",
                "nodes_ok": ["carriage", "motor"],
                "axes_ok": ["velocity"],
                "sizes": {},
            }
            for name in held.get(kind, [])
        ]
        a = {"kind": kind, "size": size, "ratio": 9.0, "effects": effects, "true_parameters": {}}
        a |= {"plant": ("belt", "hoist")[i % 2]} | ({"unnamed_ok": True} if kind == "decoy" else {})
        cases[f"case-{i:04d}"] = a
    return cases


@pytest.mark.parametrize("twin", [False, True])
def test_correct_names_and_equivalent_names_get_the_full_score(twin):
    cases = answers_of_all_kinds()
    R = score(cases, {c: oracle(a, twin) for c, a in cases.items()})
    assert (R["single"]["top1"], R["node_accuracy"], R["named_precision"], R["pair"]["all_found"]) == (1, 1, 1, 1)
    assert (R["null"]["false_alarms"], R["unknown"]["false_names"], R["failures"]) == (0, 0, [])
    assert R["by_plant"]["hoist"]["single"] == 1.0
    assert sum(x["cases"] for x in R["by_plant"].values()) == len(cases)


def test_unnamed_force_is_a_correct_answer_for_a_decoy():
    cases = {c: a for c, a in answers_of_all_kinds().items() if a["kind"] in ("decoy", "null")}
    R = score(cases, {c: {"verdict": "unnamed", "effects": []} for c in cases})
    assert R["null"]["by_kind"]["decoy"] == [0, 3] and R["null"]["by_kind"]["null"] == [7, 7]


@pytest.mark.skipif(not (SHARED / "score.py").exists(), reason="no practice cases here")
@pytest.mark.parametrize("seed", [1, 2])
def test_scores_agree_with_the_scorer_of_the_practice_cases(seed):
    spec = importlib.util.spec_from_file_location("machines_score", SHARED / "score.py")
    theirs = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(theirs)
    practice = json.loads((SHARED / "practice" / "answers.json").read_text())["cases"]
    answers = answers_of_all_kinds() | {f"practice-{c}": a for c, a in practice.items()}
    rng = np.random.default_rng(seed)
    diagnoses = {}
    for case, a in answers.items():
        d = oracle(a, bool(rng.integers(2)))
        wrong = {"name": "load.bump", "node": "carriage", "confidence": float(rng.random())}
        d["effects"] = [d["effects"], [*d["effects"], wrong], [wrong, *d["effects"]], []][rng.integers(4)]
        d["verdict"] = str(rng.choice([d["verdict"], d["verdict"], "ambiguous", "unnamed", "named"]))
        diagnoses[case] = d
    want, found = theirs.score(answers, diagnoses.get)[0], score(answers, diagnoses)
    same = ("cases", "missing", "node_accuracy", "axis_accuracy", "named_precision", "null", "unknown", "single")
    for key in (*same, "names_given"):
        assert found[key] == want[key], key
    assert {k: found["pair"][k] for k in want["pair"]} == want["pair"]
    assert found["brier"] == want["brier"]
