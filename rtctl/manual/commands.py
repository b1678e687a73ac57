"""Description of the command line: each command with its text, examples, arguments and options."""

import shlex
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import typer

from rtctl.cli.main import app
from rtctl.config.errors import UserError

EXAMPLES = "Examples:"


class Parameter(NamedTuple):
    names: tuple[str, ...]  # ("--out", "-o"), or ("CONFIG",) of an argument
    value: str  # placeholder of the value, e.g. "FILE"; "" for a flag
    help: str
    required: bool
    repeated: bool

    @property
    def argument(self) -> bool:
        return not self.names[0].startswith("-")


class Command(NamedTuple):
    """One command, or a group of them, which has no parameters of its own."""

    words: tuple[str, ...]  # as typed: ("rtctl", "campaign", "run")
    text: tuple[str, ...]  # paragraphs
    examples: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    group: bool

    @property
    def name(self) -> str:
        return " ".join(self.words)

    @property
    def usage(self) -> str:
        """Usage line: the command with its options and arguments."""
        told = [p.names[0] if p.required else f"[{p.names[0].strip('[]')}]" for p in self.parameters if p.argument]
        options = ["[OPTIONS]"] if any(not p.argument for p in self.parameters) else []
        return " ".join([self.name, *(["COMMAND"] if self.group else []), *options, *told])


def commands() -> Iterator[Command]:
    """All commands, in the order of the help, each group before its members."""
    yield from _walk(root(), None, ("rtctl",))


def _walk(command: Any, parent: Any, words: tuple[str, ...]) -> Iterator[Command]:
    context = command.context_class(command, info_name=words[-1], parent=parent)
    yield _describe(command, words)
    for name in _members(command, context):
        yield from _walk(command.get_command(context, name), context, (*words, name))


def _members(command: Any, context: Any) -> list[str]:
    return list(command.list_commands(context)) if hasattr(command, "list_commands") else []


def _describe(command: Any, words: tuple[str, ...]) -> Command:
    paragraphs = [" ".join(part.split()) for part in (command.help or "").split("\n\n") if part.strip()]
    cut = paragraphs.index(EXAMPLES) if EXAMPLES in paragraphs else len(paragraphs)
    parameters = tuple(_parameter(p) for p in command.params if not getattr(p, "hidden", False))
    return Command(
        words, tuple(paragraphs[:cut]), tuple(paragraphs[cut + 1 :]), parameters, hasattr(command, "list_commands")
    )


def _parameter(found: Any) -> Parameter:
    repeated = bool(getattr(found, "multiple", False)) or found.nargs == -1
    if found.param_type_name == "argument":
        name = (found.metavar or found.name.upper()).strip("[].")
        return Parameter((name,), "", found.help or "", bool(found.required), repeated)
    flag = bool(getattr(found, "is_flag", False))
    value = "" if flag else (found.metavar or "VALUE")
    return Parameter((*found.opts, *found.secondary_opts), value, found.help or "", bool(found.required), repeated)


@lru_cache(maxsize=1)
def root() -> Any:
    """Root command of the command line."""
    return typer.main.get_command(app)


def parse(line: str) -> tuple[str, ...]:
    """Words of the command that a shell line calls, without calling it. Raises UserError where the line is wrong.

    Words after |, >, & or ; belong to another program, and # begins a comment.
    """
    words: Sequence[str] = shlex.split(line, comments=True)
    ends = [i for i, word in enumerate(words) if word in ("|", "&", "&&", ";") or word.startswith((">", "2>"))]
    words = words[: min(ends)] if ends else words
    if not words or words[0] != "rtctl":
        raise UserError(f"{line}: not a command of rtctl")
    command, parent, left = root(), None, list(words[1:])
    path: tuple[str, ...] = ("rtctl",)
    try:
        while hasattr(command, "list_commands") and left and not left[0].startswith("-"):
            parent = command.context_class(command, info_name=path[-1], parent=parent)
            command, path = command.get_command(parent, left[0]), (*path, left[0])
            left = left[1:]
        if set(left) & {"--help", "--version", "--install-completion", "--show-completion"}:
            return path
        if hasattr(command, "list_commands"):
            raise UserError(f"{line}: {' '.join(path)} is a group; say which of its commands")
        command.make_context(path[-1], left, parent=parent)
    except UserError:
        raise
    except Exception as error:  # typer's error classes, which typer does not export
        raise UserError(f"{line}: {getattr(error, 'message', '') or error!r}") from error
    return path
