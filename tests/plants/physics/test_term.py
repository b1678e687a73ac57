"""Properties of every term of the bench, on every plant and at every node of the term."""

import re
from functools import cache
from typing import Any

import bench
import numpy as np
import pytest

from rtctl.plants.physics import TERMS, by_kind, nodes

EVERYWHERE = [
    (name, kind, node) for name, term in bench.TERMS.items() for kind, there in by_kind(term).items() for node in there
]
ONCE = [(name, kind) for name, term in bench.TERMS.items() for kind in by_kind(term)]
UNDAMPED = {
    "axis": {"F_v": 0.0},
    "ivu": {"k_m1": 0.0, "k_m2": 0.0, "k1": 0.0, "k2": 0.0},
    "ldu": {"b_s": 0.0, "b_c": 0.0, "B_c": 0.0, "B_m": 0.0, "K_m2": 0.0},
}


@cache
def plain(kind: str, loose: bool, finer: int = 1) -> bench.Run:
    """Run of the machine without the term."""
    return bench.run(kind, [], bench.moves(kind, loose=loose), substeps=finer * bench.SUBSTEPS[kind])


def counts(kind: str, a: bench.Run, b: bench.Run) -> float:
    """Largest difference of any sensor, counts."""
    return float(np.abs((a.y - b.y) / np.array(bench.COUNT[kind])).max())


@pytest.mark.parametrize(("name", "kind", "node"), EVERYWHERE)
def test_term_of_size_zero_has_no_effect(name, kind, node):
    loose = name == "tape.slack"
    with_it = bench.run(kind, [bench.nothing(name, kind, node)], bench.moves(kind, loose=loose))
    assert counts(kind, with_it, plain(kind, loose)) < 1e-3


@pytest.mark.parametrize(("name", "kind", "node"), EVERYWHERE)
def test_term_of_typical_size_is_visible(name, kind, node):
    loose = name == "tape.slack"
    with_it = bench.run(kind, [bench.usual(name, kind, node)], bench.moves(kind, loose=loose))
    assert np.isfinite(with_it.y).all()
    assert counts(kind, with_it, plain(kind, loose)) > 1.0


@pytest.mark.parametrize(("name", "kind"), ONCE)
def test_motion_converges_with_the_step_size(name, kind):
    loose, term = name == "tape.slack", bench.usual(name, kind)
    h, half, exact = (
        bench.run(kind, [term], bench.moves(kind, loose=loose), substeps=f * bench.SUBSTEPS[kind]) for f in (1, 2, 8)
    )
    error, less = counts(kind, h, exact), counts(kind, half, exact)
    assert less < 0.1 or less < 0.6 * error
    assert error < 0.3 or error < 0.03 * counts(kind, h, plain(kind, loose))


@pytest.mark.parametrize(("name", "kind", "node"), EVERYWHERE)
def test_passive_term_never_increases_the_kinetic_energy(name, kind, node):
    if not bench.TERMS[name].passive:
        pytest.skip("it feeds energy in by its nature")
    speeds = {
        "axis": {"carriage": 0.1},
        "ivu": {"motor1": 0.6, "capstan": -0.8, "motor2": -1.0},
        "ldu": {"motor": 100.0},
    }
    r = bench.run(
        kind,
        [bench.usual(name, kind, node)],
        np.zeros((300, len(bench.PLANTS[kind].DRIVES))),
        speeds=speeds[kind],
        substeps=4 * bench.SUBSTEPS[kind],
        **UNDAMPED[kind],
    )
    v = np.zeros((1, r.s.m.nq))
    for pushed, speed in speeds[kind].items():
        v[0, bench.place(kind, pushed).node] = speed
    assert bench.kinetic(r.s, r.v).max() < bench.kinetic(r.s, v)[0] * 1.002


def test_term_allocates_no_memory(allocations):
    kind, loop = "ivu", bench.moves("ivu", 0.01)
    function, params, states = bench.compiled(kind)
    p, s = bench.plant(kind, 5e-4)
    known = [term for term in bench.TERMS.values() if nodes(term, kind)]
    slots, ps, ss = (np.zeros(len(known), d).view(np.recarray) for d in (bench.SLOT, params, states))
    for n, term in enumerate(known):
        spot = bench.place(kind, nodes(term, kind)[0])
        slots[n] = (n + 1, spot.node, spot.link, spot.channel, 1.0)
        bench.fill_record(ps[n][term.name.replace(".", "_")], term.build(bench.usual(term.name, kind), 5e-4))
    out: tuple[Any, ...] = (np.zeros((10, 5)), np.zeros((10, 5)), np.zeros((10, 3)), np.zeros(10))
    without = allocations(function, slots[:0], ps, ss, p, s, loop, 2, *out)  # allocations of the call
    assert allocations(function, slots, ps, ss, p, s, loop, 2, *out) == without


@pytest.mark.parametrize("name", sorted(TERMS))
def test_every_term_is_documented_for_the_mechanic(name):
    term = TERMS[name]
    assert name == term.name == term.settings.model_fields["term"].default
    assert len(term.words) > 20 and len(term.equation) > 4 and len(term.source) > 4
    assert term.stands and term.check.endswith(".") and term.phrase
    assert len(term.look_alikes) >= 2 and name not in term.look_alikes
    for rival, experiment in term.look_alikes.items():
        assert re.fullmatch(r"[a-z]+\.[a-z_]+", rival), rival
        assert len(experiment) > 20
    assert set(term.typical) <= set(term.settings.model_fields)
    assert set(term.scale) <= set(term.typical)
    assert all(low < high for low, high in term.typical.values())
    assert term.axis in ("time", "velocity", "position", "angle", "command", "tension", "frequency")
    for field in term.settings.model_fields.values():
        assert field.annotation is not float or field.description
