"""docs/commands.md: the command reference, a section for each command."""

from collections.abc import Iterable

from rtctl.manual.commands import Command, Parameter, commands

HEAD = """# Commands

Every command of `rtctl`, as `--help` and `man rtctl` show it.

| exit code | |
|---|---|
| 0 | done |
| 1 | the machine tripped, a check said no, or a fault of rtctl itself |
| 2 | a mistake in what was asked; one line says where, and what would be right |
| 3 | the data support no answer |
| 130 | Ctrl-C |

`rtctl --install-completion` teaches bash, zsh or fish to complete commands, options, configs, keys and running
machines.
"""


def command_pages() -> dict[str, str]:
    """File name -> text."""
    found = list(commands())
    table = [f"| [`{c.name}`](#{anchor(c)}) | {cell(c.text[0])} |" for c in found if not c.group]
    parts = [HEAD, "\n".join(["| command | |", "|---|---|", *table])]
    parts += [section(c) for c in found]
    return {"commands.md": "\n\n".join(part.strip("\n") for part in parts) + "\n"}


def anchor(command: Command) -> str:
    """Anchor of a command on the page."""
    return "-".join(command.words)


def section(command: Command) -> str:
    """Heading, usage, text, examples and table of one command."""
    parts = [f"{'##' if len(command.words) <= 2 else '###'} {command.name} {{ #{anchor(command)} }}"]
    parts += [prose(paragraph) for paragraph in command.text]
    if not command.group:
        parts += [f"```text\n{command.usage}\n```"]
    if command.examples:
        parts += ["```bash\n" + "\n".join(command.examples) + "\n```"]
    if command.parameters:
        parts += ["\n".join(_table(command.parameters))]
    return "\n\n".join(parts)


def _table(parameters: Iterable[Parameter]) -> Iterable[str]:
    yield "| | | |"
    yield "|---|---|---|"
    for p in parameters:
        names = " ".join(f"`{name}`" for name in p.names)
        notes = ["required"] if p.required and not p.argument else []
        notes += ["repeatable"] if p.repeated and "epeatable" not in p.help else []
        told = cell(p.help) + (f" ({', '.join(notes)})" if notes else "")
        yield f"| {names} | {f'`{p.value}`' if p.value else ''} | {told} |"


def prose(text: str) -> str:
    """Text with < escaped for HTML, except in code between backticks."""
    return "`".join(part if i % 2 else part.replace("<", "&lt;") for i, part in enumerate(text.split("`")))


def cell(text: str) -> str:
    """Text for a cell of a Markdown table."""
    return prose(" ".join(text.split())).replace("|", "\\|")
