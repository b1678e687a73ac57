"""Writes the beginning of a machine of the user's own: a config that describes one, commented, and runs as it is."""

import re
from importlib import resources
from pathlib import Path

from rtctl.config.errors import UserError, nearest
from rtctl.config.files import write_text

NAME = re.compile(r"[A-Za-z0-9_-]{1,40}")


def examples() -> list[str]:
    """Names of the machines to start from."""
    folder = Path(str(resources.files("rtctl.configs"))) / "machines"
    return sorted(path.stem for path in folder.glob("*.yaml"))


def write_machine(name: str, like: str, folder: Path) -> Path:
    """Write NAME.yaml, a described machine like one that comes with rtctl, into a folder; returns its path.

    Raises UserError, and writes nothing, where it is there already or a name does not do.
    """
    known = examples()
    if like not in known:
        near = nearest(like, known)
        hint = f"did you mean '{near}'?" if near else f"there is {', '.join(known)}"
        raise UserError(f"--like {like}: no such machine; {hint}")
    path = folder / (name if Path(name).suffix in (".yaml", ".yml") else f"{name}.yaml")
    if not NAME.fullmatch(path.stem):
        raise UserError(f"'{name:.60}': a machine's name is letters, digits, - and _; write e.g. belt.yaml")
    if path.exists():
        raise UserError(f"{path}: there already, and nothing is overwritten; take another name or --into DIR")
    text = (resources.files("rtctl.configs") / "machines" / f"{like}.yaml").read_text(encoding="utf-8")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text.replace(f"\nname: {like}\n", f"\nname: {path.stem}\n", 1))
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror}") from None
    return path
