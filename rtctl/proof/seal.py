"""Seal: hash of the answers, written before the diagnosis and verifiable afterwards."""

import hashlib
import json
import secrets
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError
from rtctl.config.files import write_text

ANSWERS, SEAL = "answers.json", "seal.json"


def canonical(answers: dict[str, Any]) -> str:
    """Canonical text of the answers, independent of key order and spaces."""
    return json.dumps(answers, sort_keys=True, separators=(",", ":"), allow_nan=False)


def digest(answers: dict[str, Any], salt: str) -> str:
    return hashlib.sha256((salt + canonical(answers)).encode()).hexdigest()


def close_seal(folder: Path | str, answers: dict[str, Any]) -> str:
    """Write answers.json and seal.json; returns the hash, to be published before the diagnosis."""
    folder = Path(folder)
    salt = secrets.token_hex(16)
    sha = digest(answers, salt)
    write_text(folder / ANSWERS, json.dumps(answers, sort_keys=True, indent=1, allow_nan=False) + "\n")
    seal = {"format": 1, "sha256": sha, "salt": salt, "cases": len(answers["cases"])}
    write_text(folder / SEAL, json.dumps(seal, indent=1) + "\n")
    return sha


def open_seal(folder: Path | str) -> dict[str, Any]:
    """Answers with a verified hash. Raises UserError where the answers are not the sealed ones."""
    folder = Path(folder)
    seal, answers = _read(folder / SEAL), _read(folder / ANSWERS)
    for key in ("sha256", "salt"):
        if not isinstance(seal.get(key), str):
            raise UserError(f"{folder / SEAL} has no '{key}'; it is not a seal that `rtctl prove` wrote")
    found = digest(answers, seal["salt"])
    if found != seal["sha256"]:
        raise UserError(
            f"{folder / ANSWERS} is not what was sealed: its hash is {found[:16]}..., {SEAL} says "
            f"{seal['sha256'][:16]}...; generate the cases anew"
        )
    return answers


def _read(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        raise UserError(f"{path} is missing; `rtctl prove --generate-only` writes it") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{path} cannot be read: {error}") from None
    except json.JSONDecodeError as error:
        raise UserError(f"{path}, line {error.lineno}: not JSON, {error.msg}") from None
    if not isinstance(found, dict):
        raise UserError(f"{path} holds a {type(found).__name__}; it should hold one object {{...}}")
    return found
