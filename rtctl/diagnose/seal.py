"""Sealed file: an answer that can be checked later and is not legible in the file.

JSON with `sha256`, taken over salt and canonical text of the answer, and `sealed`, the text compressed and in base64.
The hash may be shown when the file is written; an equal hash at the opening proves that the answer was not changed.
"""

import base64
import binascii
import hashlib
import json
import os
import secrets
import zlib
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError

FORMAT = 1
LONGEST = 1_000_000  # bytes of an answer


def canonical(answer: dict[str, Any]) -> str:
    """Canonical text of an answer, independent of the order of its keys."""
    return json.dumps(answer, sort_keys=True, separators=(",", ":"), allow_nan=False)


def close_seal(path: Path | str, answer: dict[str, Any]) -> str:
    """Hash of the answer, written to a file that only its owner may read. Raises UserError where the file exists."""
    path = Path(path)
    salt, text = secrets.token_hex(16), canonical(answer)
    digest = hashlib.sha256((salt + text).encode()).hexdigest()
    sealed = base64.b64encode(zlib.compress(text.encode())).decode()
    content = {"format": FORMAT, "sha256": digest, "salt": salt, "sealed": sealed}
    try:
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(file, "w", encoding="utf-8") as out:
            out.write(json.dumps(content, indent=1) + "\n")
    except FileExistsError:
        raise UserError(f"{path} exists already; a seal is not written over, name another file") from None
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror}") from None
    return digest


def open_seal(path: Path | str) -> tuple[dict[str, Any], str]:
    """Answer and its checked hash. Raises UserError where the file is no seal, or was changed after sealing."""
    path = Path(path)
    try:
        content = json.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        raise UserError(f"{path} is missing; `rtctl plant CONFIG --conceal SEED --seal {path}` writes it") from None
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise UserError(f"{path} is not a seal: it is not JSON ({error})") from None
    for key in ("sha256", "salt", "sealed"):
        if not isinstance(content, dict) or not isinstance(content.get(key), str):
            raise UserError(f"{path} has no '{key}'; it is not a seal that `rtctl plant --conceal` wrote")
    try:
        text = zlib.decompressobj().decompress(base64.b64decode(content["sealed"], validate=True), LONGEST).decode()
    except (binascii.Error, zlib.error, ValueError):
        raise UserError(f"{path}: 'sealed' cannot be unpacked; the file was changed after it was sealed") from None
    found = hashlib.sha256((content["salt"] + text).encode()).hexdigest()
    if found != content["sha256"]:
        raise UserError(
            f"{path} is not what was sealed: its hash is {found[:16]}..., the seal says {content['sha256'][:16]}..."
        )
    answer: dict[str, Any] = json.loads(text)
    return answer, found
