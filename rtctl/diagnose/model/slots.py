"""Slots of the compiled simulation: number, place and params of each acting term.

A hypothesis of another effect is another record, and needs no compilation.
"""

import re
from typing import Any

from rtctl.plants.physics import anywhere
from rtctl.plants.physics.term import Term

SLOTS = 32  # terms of a model, at most


def field(name: str) -> str:
    """Name of a term's field in a slot."""
    return re.sub(r"\W", "_", name)


def sample(term: Term) -> Any:
    """Params of a term with arbitrary values, for their record type."""
    values: dict[str, Any] = {"node": next(iter(anywhere(term).values()))[0]}
    for name, info in term.settings.model_fields.items():
        if info.is_required() and name != "node":
            values[name] = _inside(info)
    return term.build(term.settings.model_construct(**{**_defaults(term), **values}), 1e-3)


def _defaults(term: Term) -> dict[str, Any]:
    fields = term.settings.model_fields.items()
    return {name: info.get_default(call_default_factory=True) for name, info in fields if not info.is_required()}


def _inside(info: Any) -> float:
    """Number within the bounds of a field."""
    low = max((getattr(m, k) for m in info.metadata for k in ("ge", "gt") if hasattr(m, k)), default=0.0)
    high = min((getattr(m, k) for m in info.metadata for k in ("le", "lt") if hasattr(m, k)), default=low + 2.0)
    return 0.5 * (low + min(high, low + 2.0))


def at_site(site: str, kind: str, terms: tuple[Term, ...]) -> str:
    """Text of the compiled function of a site: every term that acts at the site on a kind of machine, slot by slot."""
    lines = ["@compiled", f"def {site}(t, m):", f'    """Every term that acts at the {site}."""']
    lines += [
        "    for k in range(t.q.shape[0]):",
        "        kind = t.q[k].kind",
        "        if kind == 0:",
        "            break",
    ]
    for number, term in enumerate(terms, 1):
        act = term.act_at(site, kind)
        if act is not None:
            name = field(term.name)
            line = act.format(p=f"t.q[k].{name}", s=f"t.z[k].{name}", m="m", i="t.q[k].node", r="t.q[k].factor",
                              l="t.q[k].link", k="t.q[k].other", c="t.q[k].channel")  # fmt: skip
            lines += [f"        if kind == {number}:", *(f"            {part}" for part in line.split("\n"))]
    return "\n".join(lines)
