"""The generated simulation: its text holds every term, and a slot holds what a term needs."""

import ast

import numpy as np
import pytest

from rtctl.diagnose import kernel
from rtctl.idiom import record_dtype
from rtctl.plants import axis
from rtctl.plants.physics import TERMS, anywhere, nodes
from rtctl.plants.physics.term import SITES

PLANTS = ("ivu", "ldu", "axis")


def functions(kind: str) -> dict[str, ast.FunctionDef]:
    tree = ast.parse(kernel.source(kind))
    return {node.name: node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


def numbers(function: ast.FunctionDef) -> set[int]:
    """Kinds that a site asks for, without the empty slot."""
    found = {
        node.comparators[0].value
        for node in ast.walk(function)
        if isinstance(node, ast.Compare) and isinstance(node.left, ast.Name) and node.left.id == "kind"
    }
    return found - {0}


@pytest.mark.parametrize("kind", PLANTS)
@pytest.mark.parametrize("site", SITES)
def test_every_term_that_can_stand_in_a_plant_acts_at_its_sites(kind, site):
    wanted = {i for i, t in enumerate(kernel.terms_of(kind), 1) if t.act_at(site, kind) is not None}
    assert numbers(functions(kind)[site]) == wanted


@pytest.mark.parametrize("kind", PLANTS)
def test_no_term_with_a_node_there_is_left_out(kind):
    wanted = {name for name, term in TERMS.items() if nodes(term, kind)}
    assert {term.name for term in kernel.terms_of(kind)} == wanted
    acting = set().union(*(numbers(functions(kind)[site]) for site in SITES))
    assert acting == set(range(1, len(wanted) + 1))


@pytest.mark.parametrize("kind", PLANTS)
def test_the_text_calls_only_what_its_modules_have(kind):
    tree = ast.parse(kernel.source(kind))
    modules = {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom):
            for name in node.names:
                holder = __import__(str(node.module), fromlist=[name.name])
                modules[name.asname or name.name] = getattr(holder, name.name)
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in modules:
            assert hasattr(modules[node.value.id], node.attr), f"{node.value.id}.{node.attr}"


@pytest.mark.parametrize("kind", PLANTS)
def test_no_placeholder_is_left_in_the_text(kind):
    assert "{" not in kernel.source(kind).replace("{}", "")


@pytest.mark.parametrize("term", TERMS.values(), ids=lambda t: t.name)
def test_sample_params_have_the_layout_of_any_other(term):
    """A slot is laid out from a sample: a term whose layout hangs on its values would not fit in it."""
    given = {"node": next(iter(anywhere(term).values()))[-1]}
    for name, info in term.settings.model_fields.items():
        if info.is_required() and name != "node":
            given[name] = kernel._inside(info)
    for h in (1e-4, 2e-3):
        assert record_dtype(kernel.sample(term)) == record_dtype(term.build(term.settings(**given), h))


def test_a_slot_holds_place_and_params_of_its_term():
    k = kernel.kernel("axis")
    base = axis.build(axis.AxisSettings(), 1e-3)
    slot = np.zeros(1, k.slot)[0]
    kernel.fill_slot(k, slot, TERMS["drive.offset"].settings(node="drive", offset=0.25), base)
    assert k.names[slot["kind"] - 1] == "drive.offset"
    assert (slot["node"], slot["channel"], slot["factor"]) == (0, 0, 1.0)
    assert slot["drive_offset"]["offset"] == 0.25


def test_the_carriage_of_the_linear_drive_takes_the_radius_of_the_capstan_as_its_factor(blank):
    from rtctl.diagnose.model import owner_model, plant_params

    case = blank("ldu", np.zeros(10)).case
    params = plant_params(owner_model(case), case, 1e-4)
    terms = kernel.terms_of("ldu")
    head = [("kind", "i8"), ("node", "i8"), ("link", "i8"), ("channel", "i8"), ("factor", "f8")]
    slots = np.dtype([*head, *((kernel.field(t.name), record_dtype(kernel.sample(t))) for t in terms)])
    fake = kernel.Kernel("ldu", ast, tuple(t.name for t in terms), slots, slots, slots, slots)
    slot = np.zeros(1, slots)[0]
    kernel.fill_slot(fake, slot, TERMS["load.spring"].settings(node="carriage", k=5.0), params)
    assert slot["factor"] == params.R_c
    assert slot["load_spring"]["k"] == 5.0


def test_the_same_sources_give_the_same_module():
    assert kernel.sources_hash("axis") == kernel.sources_hash("axis")
    assert kernel.sources_hash("axis") != kernel.sources_hash("ivu")
    assert kernel.kernel("axis") is kernel.kernel("axis")
