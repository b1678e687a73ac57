"""YAML text to plain data that remembers where each value was written, and back.

Scalars follow the core schema of YAML 1.2: `off` and `no` are words, 1e3 is a number, 12:30 is text. YAML 1.1, which
PyYAML reads by default, makes False, text and 750 of them.
"""

import re
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import yaml

from rtctl.config.errors import UserError

KeyPath = tuple[str | int, ...]

MAX_VALUES = 20_000  # after anchors are expanded
MAX_DEPTH = 50

NULL, BOOL, INT, FLOAT, STR, SEQ, MAP, MERGE = (
    f"tag:yaml.org,2002:{name}" for name in ("null", "bool", "int", "float", "str", "seq", "map", "merge")
)
CORE_SCHEMA = {  # tag: pattern, and the characters with which it can start
    NULL: (re.compile(r"(?:~|null|Null|NULL|)\Z"), ["~", "n", "N", ""]),
    BOOL: (re.compile(r"(?:true|True|TRUE|false|False|FALSE)\Z"), list("tTfF")),
    INT: (re.compile(r"(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)\Z"), list("-+0123456789")),
    FLOAT: (
        re.compile(r"(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))\Z"),
        list("-+.0123456789"),
    ),
    MERGE: (re.compile(r"<<\Z"), ["<"]),
}  # fmt: skip


class Mark(NamedTuple):
    """Where a value was written: a place for people, the line if it is in a file, the text of a scalar."""

    place: str
    line: int | None
    text: str | None


@dataclass(frozen=True)
class Document:
    """Data of one file, and a mark for every key path in it (the root is the empty path)."""

    name: str
    data: Any
    marks: dict[KeyPath, Mark] = field(default_factory=dict)

    def line(self, path: KeyPath) -> int | None:
        """Line of the key or list item at `path`, counted from 1, or None where the file does not have it."""
        mark = self.marks.get(tuple(path))
        return mark.line if mark else None

    def place(self, path: KeyPath) -> Mark:
        """Where `path` was written, or else the innermost group around it."""
        for length in range(len(path), 0, -1):
            if path[:length] in self.marks:
                return self.marks[path[:length]]
        return Mark(self.name, None, None)

    def replaced(self, data: Any, path: KeyPath, value: "Document") -> "Document":
        """This document with `data`, of which the part at `path` was written in `value`."""
        marks = {key: mark for key, mark in self.marks.items() if key[: len(path)] != path}
        marks |= {(*path, *key): Mark(value.name, None, mark.text) for key, mark in value.marks.items()}
        return replace(self, data=data, marks=marks)


def parse(text: str, name: str) -> Document:
    """Data of a piece of YAML. Raises UserError that starts with `name` and the line."""
    line = 0
    try:
        loader = _Loader(text)
        try:
            root = loader.get_single_node()
        finally:
            line = loader.line
    except yaml.reader.ReaderError as error:
        code = error.character if isinstance(error.character, int) else ord(error.character)
        line = text.count("\n", 0, error.position)
        raise UserError(f"{name}:{line + 1}: character U+{code:04X} is not allowed in YAML") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        context = f" ({error.context})" if error.context else ""
        raise UserError(f"{name}:{mark.line + 1 if mark else 1}: not YAML: {error.problem}{context}") from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # an escape such as \U00110000 gets past PyYAML
        raise UserError(f"{name}:{line + 1}: not YAML: {error}") from None
    builder = _Builder(name)
    return Document(name, None if root is None else builder.build(root, ()), builder.marks)


def dump(data: Any) -> str:
    """YAML of plain data, the same for readers of YAML 1.1 and 1.2."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=120)


class _Loader(yaml.SafeLoader):
    """Composes nodes, not more of them and not deeper than a config needs."""

    yaml_implicit_resolvers: dict = {}  # noqa: RUF012

    def __init__(self, text: str):
        super().__init__(text)
        self._depth = self._count = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        self._depth += 1
        self._count += 1
        if self._depth > MAX_DEPTH or self._count > MAX_VALUES:
            problem = f"nested deeper than {MAX_DEPTH}" if self._depth > MAX_DEPTH else f"more than {MAX_VALUES} values"
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=self.peek_event().start_mark)
        node = super().compose_node(parent, index)  # type: ignore[no-untyped-call]
        self._depth -= 1
        return node


class _Dumper(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:
        return True


for _tag, (_pattern, _first) in CORE_SCHEMA.items():
    _Loader.add_implicit_resolver(_tag, _pattern, _first)
    _Dumper.add_implicit_resolver(_tag, _pattern, _first)


class _Builder:
    """Nodes to data and marks. Anchors are expanded, so the number of values is counted here too."""

    def __init__(self, name: str):
        self.name = name
        self.marks: dict[KeyPath, Mark] = {}
        self._count = 0
        self._open: set[int] = set()  # nodes being built, to notice an anchor inside itself

    def build(self, node: yaml.Node, path: KeyPath, line: int | None = None) -> Any:
        """Data of `node`, which stands at `path`. `line` is that of its key."""
        self._count += 1
        if self._count > MAX_VALUES:
            raise self._error(node, f"more than {MAX_VALUES} values once its anchors are expanded")
        if id(node) in self._open:
            raise self._error(node, "the anchor contains itself")
        line = node.start_mark.line + 1 if line is None else line
        text = node.value if isinstance(node, yaml.ScalarNode) else None
        self.marks[path] = Mark(f"{self.name}:{line}", line, text)
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node)
        self._open.add(id(node))
        value: Any
        if isinstance(node, yaml.SequenceNode) and node.tag == SEQ:
            value = [self.build(item, (*path, i)) for i, item in enumerate(node.value)]
        elif isinstance(node, yaml.MappingNode) and node.tag == MAP:
            value = self._mapping(node, path)
        else:
            raise self._error(node, f"the tag {node.tag} is not known here")
        self._open.remove(id(node))
        return value

    def _mapping(self, node: yaml.MappingNode, path: KeyPath) -> dict[str, Any]:
        value: dict[str, Any] = {}
        lines: dict[str, int] = {}
        for key, item in node.value:
            if key.tag == MERGE:
                continue
            if not isinstance(key, yaml.ScalarNode):
                raise self._error(key, "a key must be a word")
            word = self._text(key)
            line = key.start_mark.line + 1
            if word in lines:
                raise self._error(key, f"'{word}' is written twice, first in line {lines[word]}")
            lines[word] = line
            value[word] = self.build(item, (*path, word), line)
        for key, item in node.value:
            if key.tag == MERGE:
                self._merge(item, path, value)
        return value

    def _merge(self, node: yaml.Node, path: KeyPath, value: dict[str, Any]) -> None:
        """`<<: *anchor`: keys of another mapping, where this one does not have them itself."""
        sources = node.value if isinstance(node, yaml.SequenceNode) else [node]
        for source in sources:
            if not isinstance(source, yaml.MappingNode):
                raise self._error(source, "<< takes an anchor of keys and values")
            scratch = _Builder(self.name)
            scratch._count, scratch._open = self._count, self._open
            merged = scratch.build(source, path)
            self._count = scratch._count
            for word in merged.keys() - value.keys():
                self.marks |= {k: m for k, m in scratch.marks.items() if k[: len(path) + 1] == (*path, word)}
            value |= {word: item for word, item in merged.items() if word not in value}

    def _scalar(self, node: yaml.ScalarNode) -> Any:
        text = self._text(node)
        if node.tag == STR:
            return text
        if node.tag == FLOAT and CORE_SCHEMA[INT][0].match(text):
            return float(text)
        if node.tag not in CORE_SCHEMA or not CORE_SCHEMA[node.tag][0].match(text) or node.tag == MERGE:
            raise self._error(node, f"'{text}' cannot have the tag {node.tag}")
        if node.tag == NULL:
            return None
        if node.tag == BOOL:
            return text.lower() == "true"
        if node.tag == FLOAT:
            return float(text.replace(".inf", "inf").replace(".Inf", "inf").replace(".INF", "inf").lower().replace(".nan", "nan"))
        if len(text) > 400:
            raise self._error(node, "a number of more than 400 digits")
        return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))

    def _text(self, node: yaml.ScalarNode) -> str:
        if any("\ud800" <= c <= "\udfff" for c in node.value):
            raise self._error(node, "half of a surrogate pair is not a character")
        return node.value

    def _error(self, node: yaml.Node, sentence: str) -> UserError:
        return UserError(f"{self.name}:{node.start_mark.line + 1}: {sentence}")
