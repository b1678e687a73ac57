"""YAML with line numbers, by the rules of YAML 1.2: only true and false are booleans, and 1e3 is a number.

The file is read as a tree of nodes and turned into plain data here, so that no tag makes an object, every key knows
its line, and a small file cannot unfold into a large one through its aliases.
"""

import re
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from rtctl.config.errors import UserError, nearest

MOST_BYTES = 1 << 20
MOST_NODES = 20_000
DEEPEST = 60

CORE = {
    "null": (re.compile(r"~|null|Null|NULL|"), "~nN\0"),
    "bool": (re.compile(r"true|True|TRUE|false|False|FALSE"), "tTfF"),
    "int": (re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+"), "-+0123456789"),
    "float": (
        re.compile(
            r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"
        ),
        "-+.0123456789",
    ),
}
TAG = "tag:yaml.org,2002:"


class Document(NamedTuple):
    """Plain data of a file and the line of each of its keys; a path is a tuple such as ("steps", 0, "at")."""

    data: Any
    lines: dict[tuple, int] = {}  # noqa: RUF012  never written to
    path: str = ""
    texts: dict[tuple, str] = {}  # noqa: RUF012  numbers as they were written; never written to

    def line(self, path: tuple) -> int | None:
        """Line of a key, or of the nearest key around it; None where there is none."""
        for end in range(len(path), 0, -1):
            if path[:end] in self.lines:
                return self.lines[path[:end]]
        return None


def is_name(text: str) -> bool:
    """Whether a text may name a config that comes with rtctl: a bare file name, or a path below its configs without a
    suffix."""
    path = Path(text)
    dotted = text.startswith((".", "~")) or path.is_absolute()
    return bool(text) and not dotted and ".." not in path.parts and (len(path.parts) == 1 or not path.suffix)


def told(path: str | Path) -> str:
    """Sentence on which file a config's name or path stands for. Raises UserError as `find` does."""
    file = find(path)
    shipped = file.is_relative_to(Path(str(resources.files("rtctl.configs"))))
    return f"config {file.resolve()}" + (", which comes with rtctl" if shipped else "")


def find(path: str | Path) -> Path:
    """File of a config: at the path, else at the path with .yaml, else for a name the file that comes with rtctl.

    A name is a path below the configs of rtctl: `ivu`, `ivu.yaml`, `boards/ldu_nidaqmx`. A path such as `./ivu.yaml`
    never means a file of rtctl. Raises UserError with the nearest name.
    """
    text = str(path)
    folder = Path(str(resources.files("rtctl.configs")))
    places = [Path(text), Path(f"{text}.yaml")]
    if is_name(text):
        places += [
            base / name
            for base in (folder, folder / "references", folder / "machines")
            for name in (text, f"{text}.yaml")
        ]
    try:
        found = [place for place in places if place.is_file()] or [place for place in places[:2] if place.exists()]
    except (OSError, ValueError):
        found = []
    if text and found:
        return found[0]
    known = [file.relative_to(folder).with_suffix("").as_posix() for file in sorted(folder.rglob("*.yaml"))]
    by_name = {name.rpartition("/")[2]: name for name in known}
    near = nearest(Path(text).stem, by_name)
    hint = f"did you mean '{by_name[near]}'?" if near else f"rtctl comes with {', '.join(known)}"
    if near and Path(text).stem == near and not is_name(text):
        hint = f"the one that comes with rtctl is called by its bare name, {by_name[near]}"
    raise UserError(f"{text!r:.200}: no such file; {hint}")


def load_yaml(path: str | Path) -> Document:
    """Data and lines of a file. Raises UserError with file and line where it cannot be read or is not YAML."""
    return parse(_read(Path(path)), str(path))


def parse(text: str, name: str) -> Document:
    """Data and lines of a text; `name` is what messages call it. Raises UserError."""
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
        lines: dict[tuple, int] = {}
        texts: dict[tuple, str] = {}
        return Document(_Plain(lines, texts).data(node, (), 0) if node is not None else None, lines, name, texts)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = ", ".join(str(part) for part in (error.context, error.problem) if part)
        raise UserError(f"{name}{f':{mark.line + 1}' if mark else ''}: not YAML: {what}") from error
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise UserError(
            f"{name}:{line}: not YAML: the character {error.character!r} does not belong in a text"
        ) from error
    except (yaml.YAMLError, RecursionError, ValueError, OverflowError) as error:
        raise UserError(f"{name}: not YAML: {error}") from error


def scalar_tag(text: str) -> str:
    """Type of a plain scalar by YAML 1.2: null, bool, int, float or str."""
    return next((kind for kind, (pattern, _) in CORE.items() if pattern.fullmatch(text)), "str")


def _read(path: Path) -> str:
    try:
        if path.is_dir():
            raise UserError(f"{path}: is a folder, not a file")
        if path.exists() and not path.is_file():
            raise UserError(f"{path}: is not a regular file")
        with path.open("rb") as file:
            raw = file.read(MOST_BYTES + 1)
    except FileNotFoundError as error:
        raise UserError(f"{path}: no such file") from error
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise UserError(f"{str(path)!r:.200}: not the name of a file") from error
    if len(raw) > MOST_BYTES:
        raise UserError(f"{path}: is bigger than 1 MiB; a config is not")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise UserError(f"{path}:{line}: not UTF-8 text; save the file as UTF-8") from error


class _Loader(yaml.SafeLoader):
    """YAML loader with a limit on the number and the depth of nodes."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.count = self.depth = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        self.count += 1
        self.depth += 1
        mark = self.peek_event().start_mark
        _check_size(self.count, self.depth, mark)
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


_Loader.yaml_implicit_resolvers = {}
for _kind, (_pattern, _first) in CORE.items():  # PyYAML looks a pattern up by the first character
    _Loader.add_implicit_resolver(TAG + _kind, re.compile(f"(?:{_pattern.pattern})\\Z"), list(_first))
_Loader.yaml_implicit_resolvers[""] = _Loader.yaml_implicit_resolvers.pop("\0")  # a missing value is null


class _Plain:
    """Turns nodes into dicts with text as keys, lists and scalars. Notes lines of keys and texts of numbers."""

    def __init__(self, lines: dict[tuple, int], texts: dict[tuple, str]) -> None:
        self.lines = lines
        self.texts = texts
        self.count = 0

    def data(self, node: yaml.Node, path: tuple, depth: int) -> Any:
        self.count += 1  # again for each alias: the limit is on the unfolded size
        _check_size(self.count, depth, node.start_mark)
        if path:
            self.lines.setdefault(path, node.start_mark.line + 1)
        if isinstance(node, yaml.MappingNode):
            self._known_tag(node, "map")
            return self._mapping(node, path, depth)
        if isinstance(node, yaml.SequenceNode):
            self._known_tag(node, "seq")
            return [self.data(item, (*path, i), depth + 1) for i, item in enumerate(node.value)]
        value = self._scalar(node)
        if isinstance(value, (int, float)):
            self.texts[path] = str(node.value)
        return value

    def _mapping(self, node: yaml.MappingNode, path: tuple, depth: int) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise yaml.MarkedYAMLError(problem="a key must be a word", problem_mark=key.start_mark)
            name = str(key.value)
            if name in result:
                before = self.lines.get((*path, name))
                problem = f"the key '{name}' is here twice, first in line {before}"
                raise yaml.MarkedYAMLError(problem=problem, problem_mark=key.start_mark)
            self.lines.setdefault((*path, name), key.start_mark.line + 1)
            result[name] = self.data(value, (*path, name), depth + 1)
        return result

    def _scalar(self, node: yaml.Node) -> Any:
        text = str(node.value)
        kind = node.tag.removeprefix(TAG)
        if kind == "str":
            return text
        if kind == "float" and scalar_tag(text) in ("int", "float"):
            return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
        if kind not in CORE or scalar_tag(text) != kind:
            raise yaml.MarkedYAMLError(problem=f"'{text:.40}' cannot be a {node.tag:.40}", problem_mark=node.start_mark)
        if kind == "int":
            return _integer(text)
        return None if kind == "null" else text.lower() == "true"

    def _known_tag(self, node: yaml.Node, kind: str) -> None:
        if node.tag != TAG + kind:
            raise yaml.MarkedYAMLError(
                problem=f"tags such as {node.tag:.60} mean nothing here", problem_mark=node.start_mark
            )


def _integer(text: str) -> int | float:
    if len(text) > 300:  # too long for a setting; infinity is refused later
        return float("inf")
    return int(text, 0) if text[:2] in ("0x", "0o") else int(text)


def _check_size(count: int, depth: int, mark: Any) -> None:
    if count > MOST_NODES:
        raise yaml.MarkedYAMLError(problem=f"more than {MOST_NODES} values, aliases unfolded", problem_mark=mark)
    if depth > DEEPEST:
        raise yaml.MarkedYAMLError(problem=f"nested more than {DEEPEST} deep", problem_mark=mark)
