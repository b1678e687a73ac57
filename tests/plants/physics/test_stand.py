"""Properties of every term on the stand: no effect at size zero, visibility, step convergence, documentation."""

from typing import Any

import numpy as np
import pytest
import stand

from rtctl.plants.physics import by_kind, nodes

USUAL: dict[str, dict[str, Any]] = {
    "drive.offset": {"offset": 0.02},
    "drive.deadband": {"band": 0.02},
    "drive.gain_asymmetry": {"a": 0.03},
    "drive.saturation": {"limit": 0.25},
    "drive.supply_sag": {"k": 0.01},
    "drive.lag": {"tau": 6e-4},
    "drive.thermal": {"a": 0.05, "tau": 3.0},
    "timing.delay": {"extra": 6e-4},
    "timing.jitter": {"sigma": 2e-4},
    "ripple.cogging": {"A": 5e-4, "per_turn": 7.0},
    "ripple.encoder": {"A": 8e-4},
    "ripple.reel": {"e": 5e-5},
    "ripple.capstan": {"a": 2e-5},
    "guide.thickness": {"A": 2e-6},
    "guide.strip": {"longer": 5e-5},
    "guide.dirt": {"A": 5e-6, "at": 0.01},
    "sensor.missed_counts": {"at": 1.0, "size": 3e-3},
    "sensor.rectified": {"share": 1.0},
    "sensor.scale": {"relative": 1e-3},
    "geometry.radius_change": {"d": 5e-4},
}
BY_KIND: dict[tuple[str, str], dict[str, Any]] = {
    ("ripple.cogging", "axis"): {"A": 1.0, "turn": 0.03},
    ("ripple.encoder", "axis"): {"A": 2e-6, "turn": 0.02},
}
OPTIONS: dict[str, dict[str, Any]] = {"axis": {}, "ivu": {"d_tape": 0.0}, "ldu": {"substeps": 8}}
PLACES = [(t.name, kind, node) for kind in stand.PLANTS for t in stand.terms_of(kind) for node in nodes(t, kind)]


def usual(name: str, kind: str, node: str) -> Any:
    return stand.make(name, kind, node, **{**USUAL[name], **BY_KIND.get((name, kind), {})})


@pytest.mark.parametrize(("name", "kind", "node"), PLACES)
def test_size_zero_has_no_effect_and_typical_size_is_visible(name, kind, node):
    assert stand.seen(kind, [stand.make(name, kind, node)], **OPTIONS[kind]) == 0.0
    assert stand.seen(kind, [usual(name, kind, node)], **OPTIONS[kind]) > 1.0


HALVED = [(n, k, node) for n, k, node in PLACES if n != "timing.jitter"]


@pytest.mark.parametrize(("name", "kind", "node"), HALVED)
def test_effect_converges_with_the_step_size(name, kind, node):
    volts = stand.excitation(kind, 600)
    term = usual(name, kind, node)
    steps = OPTIONS[kind].get("substeps", 4)

    def effect(substeps: int) -> np.ndarray:
        options = {**OPTIONS[kind], "substeps": substeps}
        return stand.run(kind, [term], volts, **options).y - stand.run(kind, [], volts, **options).y

    coarse, fine = effect(2 * steps), effect(4 * steps)
    assert np.abs(coarse - fine).max() < 0.1 * np.abs(fine).max() + 1e-9


def test_look_alikes_are_mutual():
    for name, term in stand.TERMS.items():
        for rival in term.look_alikes:
            if rival in stand.TERMS and set(by_kind(term)) & set(by_kind(stand.TERMS[rival])):
                assert name in stand.TERMS[rival].look_alikes, f"{rival} does not know of {name}"


@pytest.mark.parametrize("kind", stand.PLANTS)
def test_term_allocates_no_memory(kind, allocations):
    function, slot, memory = stand.compiled(kind)
    p, s = stand.plant(kind, 5e-4)
    volts = stand.excitation(kind, 3)
    q, z = np.zeros(1, slot).view(np.recarray), np.zeros(1, memory).view(np.recarray)
    x, y = np.zeros((3, s.m.nx)), np.zeros((3, s.m.ny))
    none = allocations(function, q, z, p, s, volts, 4, x, y)  # allocations of the call
    for number in range(1, len(stand.terms_of(kind)) + 1):
        q[0].number = number
        assert allocations(function, q, z, p, s, volts, 4, x, y) == none
