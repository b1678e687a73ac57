"""Mutated inputs: valid inputs with changed bytes or values."""

import math
from collections.abc import Callable, Sequence
from random import Random
from typing import Any

LENGTHS = (b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff", b"\xdb\x7f\xff\xff\xff", b"\xc6\xff\xff\xff\xff",
           b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff\x0f", b"\x00\x00\x00\x80", b"\xff" * 8)  # fmt: skip
OPENINGS = (b"\x91", b"\x81\xa1x", b"[", b'{"x":', b"- ", b"\xa1")  # of what may nest
WORDS = (
    "", "x", "\x00", "\n", "\x1b[31m", "a" * 300, "9" * 400, "1e999", "-0", "nan", "1 m^9^9^9", "m**9**9", "__class__",
    "..", "../../x", "loop.rate", "law.position.gain", "reference.steps.0.at", "physics.0.term", "record.trace", "0",
    "\u00b5m", "\U0001f600", "\ud800", "5 mm", "1 Hz", "true", "null", "abs(u) > 1", "t" + "*t" * 150, "(" * 100,
)  # fmt: skip
NUMBERS = (
    0, 1, -1, 2, 255, 2**31 - 1, 2**31, 2**32, 2**53 + 1, 2**63 - 1, -(2**63), 2**64 - 1, 10**19 - 1, 0.5, -0.0, 1e-320,
    1e308, -1e308, 1e-3, math.nan, math.inf, -math.inf,
)  # fmt: skip


def of_bytes(rng: Random, seeds: Sequence[bytes]) -> bytes:
    """A seed with one to four changed places; sometimes only noise."""
    if rng.random() < 0.02:
        return rng.randbytes(rng.randrange(200))
    data = bytearray(rng.choice(seeds))
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(data) + 1)
        match rng.randrange(8):
            case 0 if at < len(data):
                data[at] ^= 1 << rng.randrange(8)
            case 1 if at < len(data):
                data[at] = rng.choice(b"\x00\xff\x80\x7f") if rng.random() < 0.5 else rng.randrange(256)
            case 2:
                del data[at : at + rng.randint(1, 16)]
            case 3:
                data[at:at] = data[at : at + rng.randint(1, 32)]
            case 4:
                word = rng.choice(LENGTHS)
                data[at : at + (len(word) if rng.random() < 0.5 else 0)] = word
            case 5:
                other = rng.choice(seeds)
                data[at:] = other[rng.randrange(len(other) + 1) :]
            case 6:
                del data[at:]
            case 7:
                data[at:at] = rng.choice(OPENINGS) * rng.choice((9, 2000))
    return bytes(data)


def of_text(rng: Random, seeds: Sequence[bytes]) -> bytes:
    """A seed with words, numbers and signs put in, taken out and exchanged, as one changes a file by hand."""
    data = rng.choice(seeds).decode()
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(data) + 1)
        end = at + rng.choice((0, 0, 1, 4, 12))
        new = rng.choice((word(rng), str(rng.choice(NUMBERS)), rng.choice(" :-*&!#|>'\"{}[],\n%@`()<=+/^.")))
        data = data[:at] + new + data[end:]
    return data.encode("utf-8", "surrogatepass")


def of_tree(rng: Random, tree: Any) -> Any:
    """A copy of the tree with one to three of its values exchanged, added or taken out."""
    for _ in range(rng.randint(1, 3)):
        tree = _changed(rng, tree)
    return tree


def word(rng: Random) -> str:
    return rng.choice(WORDS) if rng.random() < 0.8 else "".join(chr(rng.randrange(1, 0x250)) for _ in range(5))


def value(rng: Random, depth: int = 0) -> Any:
    """Any value of msgpack and JSON, with unusual ones."""
    kinds: tuple[Callable[[], Any], ...] = (
        lambda: rng.choice((None, True, False)),
        lambda: rng.choice(NUMBERS),
        lambda: word(rng),
        lambda: [value(rng, depth + 1) for _ in range(rng.randrange(4))] if depth < 4 else [],
        lambda: {word(rng): value(rng, depth + 1) for _ in range(rng.randrange(4))} if depth < 4 else {},
        lambda: [0] * rng.choice((5, 500, 5000)),
        lambda: _nested(rng.choice((5, 12, 60, 200))),
    )
    return rng.choices(kinds, (2, 6, 6, 2, 2, 0.3, 0.5))[0]()


def _nested(depth: int) -> Any:
    made: Any = 1.0
    for k in range(depth):
        made = [made] if k % 2 else {"x": made}
    return made


def _changed(rng: Random, node: Any) -> Any:
    if isinstance(node, dict) and node and rng.random() < 0.85:
        key = rng.choice(list(node))
        choice = rng.random()
        if choice < 0.08:
            return {name: item for name, item in node.items() if name != key}
        if choice < 0.16:
            return {**node, (word(rng) if rng.random() < 0.7 else key + "_"): value(rng)}
        return {**node, key: _changed(rng, node[key])}
    if isinstance(node, list) and node and rng.random() < 0.85:
        at = rng.randrange(len(node))
        return [*node[:at], _changed(rng, node[at]), *node[at + rng.choice((0, 1, 1, 1)) :]]
    if isinstance(node, (int, float)) and not isinstance(node, bool) and rng.random() < 0.3:
        return node * rng.choice((-1, 0, 2, 1e-6, 1e6, 1e300))
    return value(rng)
