"""New config of the user, with comments, that runs unchanged: a copy of a shipped config, of a described machine or of
a unit with a plant of its own."""

import re
from importlib import resources
from pathlib import Path

from rtctl.config.errors import UserError, nearest
from rtctl.config.files import write_text

BESIDE = re.compile(r"^[^#\n]*\bkind: \./(\w+\.py):", re.MULTILINE)  # a file that a machine's YAML names
NAME = re.compile(r"[A-Za-z0-9_-]{1,40}")


SHIPPED = {"machine": "machines", "config": ""}  # kind -> folder of the shipped configs


def examples(kind: str) -> list[str]:
    """Names of the machines, or of the configs, to start from."""
    folder = Path(str(resources.files("rtctl.configs"))) / SHIPPED[kind]
    return sorted(path.stem for path in folder.glob("*.yaml"))


def write_like(kind: str, name: str, like: str, folder: Path) -> Path:
    """Path of a new NAME.yaml in `folder`, a copy of a shipped config or described machine.

    A file of mechanics or of a law that the copy names is written beside it; an existing file with equal text stays.

    Raises UserError, and writes nothing, where NAME.yaml exists or a name is invalid.
    """
    known = examples(kind)
    if like not in known:
        near = nearest(like, known)
        hint = f"did you mean '{near}'?" if near else f"there is {', '.join(known)}"
        other = next((k for k in SHIPPED if like in examples(k)), None)
        raise UserError(f"--like {like}: no such {kind}; {f'rtctl new {other} starts from it' if other else hint}")
    path = folder / (name if Path(name).suffix in (".yaml", ".yml") else f"{name}.yaml")
    if not NAME.fullmatch(path.stem):
        raise UserError(f"'{name:.60}': a {kind}'s name is letters, digits, - and _; write e.g. belt.yaml")
    if path.exists():
        raise UserError(f"{path}: there already, and nothing is overwritten; take another name or --into DIR")
    shipped = resources.files("rtctl.configs") / SHIPPED[kind]
    text = (shipped / f"{like}.yaml").read_text(encoding="utf-8")
    beside = {path.parent / name: (shipped / name).read_text(encoding="utf-8") for name in BESIDE.findall(text)}
    for file, code in beside.items():
        if file.exists() and file.read_text(encoding="utf-8", errors="replace") != code:
            raise UserError(f"{file}: there already, with another text, and nothing is overwritten; take --into DIR")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text.replace(f"\nname: {like}\n", f"\nname: {path.stem}\n", 1))
        for file, code in beside.items():
            write_text(file, code)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror}") from None
    return path
