"""docs/config*.md: the config reference, a table for each part of a config."""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from rtctl.config.fields import Shape, child, shape
from rtctl.config.schema import Row, about, settings_table
from rtctl.machines import CONFIGS, EVERY
from rtctl.machines.base import MachineSettings
from rtctl.machines.profiles import profile_of
from rtctl.manual.command_pages import cell
from rtctl.plants.physics import TERMS, by_kind

SHOWN = {"described": "belt"}  # kind of machine -> config shown on its page, where the names differ
PHYSICS = "plant.physics[]"
HEAD = """# Config

A config is a YAML file. A quantity is a number in SI or a text with a unit (`160 ms`, `2.4 mNm`, `20 mm/s`); an angle
is a dimension, so 8 Hz is 50.3 rad/s. An unknown key is an error that names the nearest right one. `rtctl check FILE`
says whether a file is right, `rtctl schema ivu` prints the same as JSON Schema for an editor, and `--set KEY=VALUE`
changes any key from the command line:

```bash
rtctl check ivu
rtctl schema ivu > ivu.schema.json
rtctl run ivu --set law.position.gain='25 V/rad' --set loop.mode=fused --for 5s
```

In a path `[]` stands for any item of a list (`reference.steps.0.at` is of the first), `NAME` for a name of your own,
and a word in brackets for the kind that was chosen. A key without a default must be given.

The keys on this page are those of every machine. Each machine has a page for its own: {pages}. What can stand in
`plant.physics` is on [a page of its own](config_physics.md).
"""
MACHINE = """# Config: {title}

The keys of `machine: {kind}` beside [those of every machine](config.md). The config that comes with rtctl:

```yaml
{text}
```
"""
TERM_HEAD = """---
search: {boost: 4}
---

# Config: physics

The terms that can stand in the list `plant.physics` of any config, each at a node: what an emulated machine can have
beyond its equations, what `rtctl diagnose` can find, and what a fitted model carries. `rtctl physics TERM` draws one.

```bash
rtctl run ivu --set 'plant.physics=[{term: friction.stribeck, node: motor1, F_s: 4.0e-3, v_s: 0.3}]' --for 12s
rtctl physics friction.stribeck
```

A force or a speed without a unit below is in N or Nm, m/s or rad/s, as its node slides or turns.
"""


class Part(NamedTuple):
    """Group of keys: its paths, its purpose, and a row for each key."""

    paths: tuple[str, ...]
    about: str
    rows: tuple[Row, ...]


def config_pages() -> dict[str, str]:
    """File name -> text."""
    pages = ", ".join(f"[{kind}](config_{kind}.md)" for kind in EVERY)
    common = parts(MachineSettings)
    found = {"config.md": page(HEAD.format(pages=pages), common), "config_physics.md": _physics()}
    shared = {part.paths for part in common} - {("",)}
    for kind, model in EVERY.items():
        own = [part for part in parts(model) if part.paths not in shared]
        own = [p._replace(rows=tuple(r for r in p.rows if r.path not in MachineSettings.model_fields)) for p in own]
        head = MACHINE.format(title=profile_of(kind).title or "Any machine", kind=kind, text=_shipped(kind))
        found[f"config_{kind}.md"] = page(head, own)
    return found


def _shipped(kind: str) -> str:
    from rtctl.config.yaml_file import find

    return find(SHOWN.get(kind, kind)).read_text().rstrip("\n")


def _physics() -> str:
    model = next(iter(CONFIGS.values()))
    rows = [row for row in settings_table(model) if row.path.startswith(PHYSICS)]
    text = [TERM_HEAD.rstrip("\n")]
    for name, term in TERMS.items():
        start = f"{PHYSICS}[{name}]."
        mine = [row._replace(path=row.path.removeprefix(start)) for row in rows if row.path.startswith(start)]
        there = [f"{kind} {', '.join(f'`{n}`' for n in nodes)}" for kind, nodes in by_kind(term).items()]
        there = there or ["those of described machines"]
        text += [f"## {name} {{ #{name.replace('.', '-')} }}", sentences(term.words, about(term.settings))]
        text += [
            f"```text\n{term.equation}\n```",
            f"Nodes: {'; '.join(there)}. Source: {cell(term.source)}.",
        ]
        text += ["\n".join(table([row for row in mine if row.path not in ("term", "node")]))]
    return "\n\n".join(text) + "\n"


def sentences(*texts: str) -> str:
    """Texts joined, each with a full stop, and the first letter as a capital."""
    whole = " ".join(cell(text).rstrip(".") + "." for text in texts)
    return whole[:1].upper() + whole[1:]


def page(head: str, found: Iterable[Part]) -> str:
    """Page of a head and a section for each part."""
    text = [head.rstrip("\n")]
    for part in found:
        if part.rows:
            title = ", ".join(f"`{path}`" for path in part.paths) if part.paths[0] else "At the top"
            text += [f"## {title}", cell(part.about), "\n".join(table(part.rows))]
    return "\n\n".join(text) + "\n"


def table(rows: Iterable[Row]) -> Iterator[str]:
    """Lines of a Markdown table of settings, each by the last word of its path."""
    yield "| key | type | unit | default | bounds | meaning |"
    yield "|---|---|---|---|---|---|"
    for row in rows:
        default = f"`{cell(row.default)}`" if row.default else ""
        key = row.path.rpartition(".")[2]
        yield f"| `{key}` | {cell(row.type)} | {cell(row.unit)} | {default} | {cell(row.bounds)} | {cell(row.help)} |"


def parts(model: Any) -> list[Part]:
    """Parts of a config in the order of the file; equal parts, such as two sensors of a kind, become one."""
    rows: dict[str, list[Row]] = {}
    for row in settings_table(model):
        if row.type != "keys" and not row.path.startswith(f"{PHYSICS}["):
            rows.setdefault(row.path.rpartition(".")[0], []).append(row)
    found: dict[Any, Part] = {}
    for path, owner in _models(Shape(model, model=model), ""):
        mine = tuple(rows.get(path, ()))
        same = (owner, tuple(row._replace(path=row.path.rpartition(".")[2]) for row in mine))
        before = found[same].paths if same in found else ()
        found[same] = Part((*before, path), about(owner), mine)
    return list(found.values())


def _models(place: Shape, path: str) -> Iterator[tuple[str, Any]]:
    """Paths and settings classes of a config, without the terms of physics."""
    if place.model is not None:
        yield path, place.model
        for name, field in place.model.model_fields.items():
            below = f"{path}.{name}" if path else name
            yield from _models(shape(field.annotation, field), below)
    if place.item is not None and f"{path}[]" != PHYSICS:
        item = child(place, 0)
        assert item is not None
        yield from _models(item, f"{path}[]")
    if place.each is not None:
        yield from _models(shape(place.each), f"{path}.NAME")
    for word, model in place.choices.items():
        yield from _models(Shape(model, model=model), f"{path}[{word}]")
