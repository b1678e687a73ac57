"""Generated simulation: the source contains every term; a slot has the location and parameters of its term."""

import ast

import numpy as np
import pytest
from graph_cases import BELT

from rtctl.diagnose.model import kernel
from rtctl.diagnose.model.prepare import places
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.elements import spot
from rtctl.plants.graph.layout import layout
from rtctl.plants.physics import TERMS
from rtctl.plants.physics.term import SITES


def functions() -> dict[str, ast.FunctionDef]:
    tree = ast.parse(kernel.source())
    return {node.name: node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


def term_numbers(function: ast.FunctionDef) -> set[int]:
    """Term numbers of a site, without the empty slot."""
    found = {
        node.comparators[0].value
        for node in ast.walk(function)
        if isinstance(node, ast.Compare) and isinstance(node.left, ast.Name) and node.left.id == "kind"
    }
    return found - {0}


@pytest.mark.parametrize("site", SITES)
def test_every_term_is_called_at_its_sites(site):
    wanted = {i for i, t in enumerate(kernel.terms(), 1) if t.act_at(site, kernel.KIND) is not None}
    assert term_numbers(functions()[site]) == wanted


def test_kernel_contains_all_terms():
    acting = set().union(*(term_numbers(functions()[site]) for site in SITES))
    assert acting == set(range(1, len(kernel.terms()) + 1))
    assert {term.name for term in kernel.terms()} == {name for name, term in TERMS.items() if term.act}


@pytest.mark.parametrize("closed", [False, True])
def test_generated_source_calls_only_existing_functions(closed):
    tree = ast.parse(kernel.source(closed=closed))
    modules = {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom):
            for name in node.names:
                holder = __import__(str(node.module), fromlist=[name.name])
                modules[name.asname or name.name] = getattr(holder, name.name)
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in modules:
            assert hasattr(modules[node.value.id], node.attr), f"{node.value.id}.{node.attr}"


def test_generated_source_has_no_placeholder():
    assert "{" not in kernel.source().replace("{}", "")


def test_slot_has_location_and_parameters_of_its_term():
    k, machine = kernel.kernel(), layout(Description.model_validate(BELT))
    values = dict(machine.machine.paths())
    drive = next(iter(machine.machine.drives))
    settings = TERMS["drive.offset"].settings(node=drive, offset=0.25)
    slot = np.zeros(1, k.slot)[0]
    at = spot(TERMS["drive.offset"], settings, machine, places(machine), values)
    kernel.fill_slot(k, slot, settings, at, 1e-3)
    assert k.names[slot["kind"] - 1] == "drive.offset"
    assert slot["channel"] == 0
    assert slot["drive_offset"]["offset"] == 0.25


def test_equal_sources_give_the_cached_module():
    assert kernel.sources_hash() == kernel.sources_hash()
    assert kernel.sources_hash() != kernel.sources_hash(closed=True)
    assert kernel.kernel() is kernel.kernel()
