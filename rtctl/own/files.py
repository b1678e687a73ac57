"""A Python file that a config names, as ./my_law.py:MyLaw: its text, and the module made of the text.

The text is run, not the file: the text is read once, with the config, and goes with the config into every process and
every bundle. The module's name has a hash of the text, and the generated tick imports the module by this name. So the
cache of compiled ticks never confuses two texts, and a replay needs no file.
"""

import ast
import hashlib
import linecache
import re
import sys
import traceback
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from rtctl.config.files import made_in, write_text

OWN = re.compile(r"(?P<file>.+\.py):(?P<name>[A-Za-z_]\w*)")
MOST_BYTES = 1 << 18
_trusted: set[str] = set()  # sha256 of the texts that this process may run


class OwnError(ValueError):
    """Error in a user's file: a sentence that names file and line and says what would be right."""


class ForeignError(OwnError):
    """Error for code that came with data and that the user has not given by path."""


def trust(texts: Iterable[str]) -> None:
    """Allow this process to run these texts, from files that the user named or from a process of the same user."""
    _trusted.update(_sha256(text) for text in texts)


def is_trusted(text: str) -> bool:
    """Whether this process may run a text."""
    return _sha256(text) in _trusted


def give(paths: Iterable[Path]) -> None:
    """Read files that the user names on the command line, and trust them. Raises UserError."""
    from rtctl.config.errors import UserError

    for path in paths:
        try:
            read(str(path), Path())
        except OwnError as error:
            raise UserError(f"--own {error}") from None


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


class Source(NamedTuple):
    """A file and the name in it that a config asks for."""

    file: str  # as the config writes it, ./my_law.py
    name: str  # MyLaw
    text: str

    @property
    def spec(self) -> str:
        """File and name as in the config, ./my_law.py:MyLaw."""
        return f"{self.file}:{self.name}"

    @property
    def module(self) -> str:
        """Name of the module of this text, own_my_law_ and a hash."""
        stem = re.sub(r"\W", "_", Path(self.file).stem)
        return f"own_{stem}_{hashlib.sha256(self.text.encode()).hexdigest()[:12]}"

    def error(self, line: int | None, what: str) -> OwnError:
        """Error about a line of the file."""
        return OwnError(f"{self.file}:{line}: {what}" if line else f"{self.file}: {what}")

    def line_of(self, name: str) -> int | None:
        """Line where a class, a function or a value is defined at the file's top level, None where it is not."""
        for node in ast.parse(self.text).body:
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", node)]
            if name in (getattr(t, "id", None) or getattr(t, "name", None) for t in targets):
                return int(node.lineno)
        return None


def is_own(kind: Any) -> bool:
    """Whether a word of a config names a file."""
    return isinstance(kind, str) and ".py" in kind


def split(kind: str) -> tuple[str, str]:
    """File and name of ./my_law.py:MyLaw. Raises OwnError where it is not of that form."""
    match = OWN.fullmatch(kind)
    if match is None:
        raise OwnError(f"'{kind:.80}' should be a file and a name in it, such as ./my_law.py:MyLaw")
    return match["file"], match["name"]


def read(file: str, folder: Path) -> str:
    """Text of a file, whose path is relative to the `folder` of the config. Raises OwnError."""
    path = folder / file
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        raise OwnError(_missing(file, path)) from None
    except (OSError, ValueError) as error:
        raise OwnError(f"{file}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if len(raw) > MOST_BYTES:
        raise OwnError(f"{file}: is bigger than 256 KiB; a law is one short file")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise OwnError(f"{file}:{raw.count(10, 0, error.start) + 1}: not UTF-8 text; save it as UTF-8") from None
    trust([text])
    return text


def refuse_plant(config: Any, where: str = "") -> None:
    """Raise UserError where a config, as settings or as plain data, has a user's plant: analyses need the equations of
    rtctl's plants. `where` is the file of the config, for the message."""
    from rtctl.config.errors import UserError

    plant = config.get("plant") if isinstance(config, dict) else getattr(config, "plant", None)
    kind = (plant.get("kind") if isinstance(plant, dict) else getattr(plant, "kind", None)) or plant
    if is_own(kind):
        raise UserError(
            f"{where}plant.kind is '{kind}', a plant of the user's own: its equations are not those of ivu, ldu or "
            "axis, and analysis of such plants (diagnose, identify, simulate, tune) is not there yet. What works: "
            "rtctl run, replay, trace plot, trace compare, trace export, campaign; a recording can be exported and "
            "imported again as a plain axis, rtctl import --plant axis"
        )


def keep(texts: dict[str, str], folder: Path) -> None:
    """Write the texts of user files into a bundle's folder `own`, for people; a replay takes them from case.json."""
    for file, text in texts.items():
        write_text(made_in(folder, "own") / Path(file).name, text)


def _missing(file: str, path: Path) -> str:
    from rtctl.config.errors import nearest

    beside = [p.name for p in path.parent.glob("*.py") if p.exists()] if path.parent.is_dir() else []
    near = nearest(path.name, beside)
    where = f"no such file in {path.parent.resolve()}, to which the path in the config leads"
    return f"{file}: {where}" + (f"; did you mean '{near}'?" if near else "; `rtctl new law NAME` writes one")


def load(source: Source) -> ModuleType:
    """Module of a source, executed once in each process. Raises OwnError with the line that fails."""
    name = source.module
    if not is_trusted(source.text):
        raise ForeignError(
            f"{source.file}: this code came with the data, and rtctl runs no code that comes with data; read it and "
            f"give the file by path: --own {source.file} (sha256 {_sha256(source.text)[:16]}...)"
        )
    if name in sys.modules:
        return sys.modules[name]
    try:
        code = compile(source.text, source.file, "exec")
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        raise source.error(line, f"not Python: {getattr(error, 'msg', None) or error}") from None
    linecache.cache[source.file] = (len(source.text), None, source.text.splitlines(True), source.file)
    module = ModuleType(name)
    module.__file__ = source.file
    sys.modules[name] = module  # compiled code that refers to it finds it here, in any process that has read the config
    try:
        exec(code, module.__dict__)
    except Exception as error:
        del sys.modules[name]
        raise source.error(_line(error, source.file), _words(error)) from error
    return module


def _line(error: BaseException, file: str) -> int | None:
    """Last line of the file that an exception passed through."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    return lines[-1] if lines else None


def _words(error: Exception) -> str:
    if isinstance(error, ModuleNotFoundError):
        return f"there is no module '{error.name}'; an own file may import what is installed, and no file beside it"
    if isinstance(error, ImportError):
        return str(error).partition(" (")[0]
    said = str(error).strip().split("\n")[0]  # pydantic adds a web address
    return f"{type(error).__name__} while the file was read: {said}"
