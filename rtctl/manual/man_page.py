"""rtctl(1): the man page, in roff, made of the command line."""

from collections.abc import Iterator

from rtctl import __version__
from rtctl.manual.commands import Command, commands

EXIT = (
    ("0", "done"),
    ("1", "the machine tripped, a check said no, or a fault of rtctl itself"),
    ("2", "a mistake in what was asked; one line says where, and what would be right"),
    ("3", "the data support no answer"),
    ("130", "Ctrl-C"),
)
ENVIRONMENT = (
    ("RTCTL_CACHE_DIR", "where compiled ticks are kept; ~/.cache/rtctl if not set"),
    ("RTCTL_TRACEBACK", "if set, an internal error shows where it happened"),
    ("NO_COLOR", "if set, no colours"),
    ("XDG_RUNTIME_DIR", "its folder rtctl/ holds sockets and locks"),
)
FILES = (
    ("/etc/rtctl/NAME.yaml", "config of the service rtctl@NAME"),
    ("/run/rtctl/", "sockets and locks of services"),
    ("runs/NAME-DATE-TIME/", "recordings, if no other folder is given"),
)


def man_page() -> str:
    """Text of rtctl.1."""
    found = list(commands())
    return "\n".join(_lines(found)) + "\n"


def _lines(found: list[Command]) -> Iterator[str]:
    yield f'.TH RTCTL 1 "" "rtctl {__version__}" "User Commands"'
    yield from (".SH NAME", "rtctl \\- real\\-time controller daemon for motion hardware, with an emulated twin")
    yield from (".SH SYNOPSIS", ".B rtctl", "[\\fIOPTIONS\\fR] \\fICOMMAND\\fR [\\fIARGUMENTS\\fR]")
    yield ".SH DESCRIPTION"
    yield from map(escape, found[0].text)
    yield "A config is a YAML file or the name of one that comes with rtctl: ivu, ldu, axis."
    yield ".SH OPTIONS"
    yield from _parameters(found[0])
    yield ".SH COMMANDS"
    for command in found[1:]:
        yield f".SS {escape(command.usage)}"
        for paragraph in command.text:
            yield from (escape(paragraph), ".PP")
        yield from _parameters(command)
        if command.examples:
            yield from (".PP", "Examples:", ".PP", ".nf", ".RS 4", *map(escape, command.examples), ".RE", ".fi")
    for title, rows in (("EXIT STATUS", EXIT), ("ENVIRONMENT", ENVIRONMENT), ("FILES", FILES)):
        yield f".SH {title}"
        for name, text in rows:
            yield from (".TP", f".B {escape(name)}", escape(text))
    yield from (".SH SEE ALSO", ".BR systemctl (1),", ".BR chrt (1),", ".BR cyclictest (8)")


def _parameters(command: Command) -> Iterator[str]:
    for p in command.parameters:
        names = ", ".join(f"\\fB{escape(name)}\\fR" for name in p.names)
        yield from (".TP", f"{names} \\fI{escape(p.value)}\\fR" if p.value else names, escape(p.help) or "\\&")


def escape(text: str) -> str:
    """Text escaped for roff: no command at the start of a line, and a minus that can be copied."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return f"\\&{text}" if text.startswith((".", "'")) else text
