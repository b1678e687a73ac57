"""Rows as protobuf messages of fixed width, which numpy writes in one operation, and their descriptor.

Every field has a type of fixed width: `double`, `float`, `fixed32`, `fixed64`, `sfixed32`, `sfixed64`, `bool`. The
field's comment in the descriptor is its unit and its meaning, `[rad] reference`. A column name that is no protobuf
identifier stands at the start of the comment: "`position.d` [m] of the carriage".

Source: protobuf.dev, "Encoding" (tags and wire types) and descriptor.proto (SourceCodeInfo for comments).
"""

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.trace.columns import Column

ENCODING = "protobuf"
VARINT, I64, I32 = 0, 1, 5  # wire types
PATH_OF_FIELD = (4, 0, 2)  # in the descriptor: message_type, 0, field; the index of the field follows
WORDS = re.compile(r"(?:`(?P<name>[^`]+)` ?)?(?:\[(?P<unit>[^\]]*)\])?")  # at the start of a comment


class Kind(NamedTuple):
    """Field type: name in descriptor.proto, wire type, and dtype in a message."""

    name: str
    wire: int
    dtype: str


KINDS = {
    "f8": Kind("TYPE_DOUBLE", I64, "<f8"),
    "f4": Kind("TYPE_FLOAT", I32, "<f4"),
    "f2": Kind("TYPE_FLOAT", I32, "<f4"),
    **{f"i{n}": Kind("TYPE_SFIXED32", I32, "<i4") for n in (1, 2, 4)},
    "i8": Kind("TYPE_SFIXED64", I64, "<i8"),
    **{f"u{n}": Kind("TYPE_FIXED32", I32, "<u4") for n in (1, 2, 4)},
    "u8": Kind("TYPE_FIXED64", I64, "<u8"),
    "b1": Kind("TYPE_BOOL", VARINT, "|u1"),
}


class Field(NamedTuple):
    column: Column
    name: str  # in protobuf
    kind: Kind
    tag: bytes


def fields(columns: Sequence[Column], dtypes: Sequence[np.dtype]) -> list[Field]:
    """Fields in the order of `columns`, numbered from 1."""
    given: list[str] = []
    found = []
    for number, (column, dtype) in enumerate(zip(columns, dtypes, strict=True), 1):
        name = plain = identifier(column.name)
        again = 2
        while name in given:
            name, again = f"{plain}_{again}", again + 1
        given.append(name)
        kind = KINDS[dtype.str[1:]]
        found.append(Field(column, name, kind, tag(number, kind)))
    return found


def identifier(name: str) -> str:
    """Protobuf identifier of a column name: letters, digits and underscores, no digit first."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if plain[:1].isalpha() or plain[:1] == "_" else f"x{plain}"


def dtype(found: Sequence[Field]) -> np.dtype:
    """Structured dtype of a message: `tag0`, `value0`, `tag1`, `value1`, ..."""
    parts: list[tuple[str, str]] = []
    for n, field in enumerate(found):
        parts += [(f"tag{n}", f"V{len(field.tag)}"), (f"value{n}", field.kind.dtype)]
    return np.dtype(parts)


def descriptor(package: str, message: str, found: Sequence[Field]) -> bytes:
    """Serialised FileDescriptorSet of a message, for MCAP and Foxglove."""
    from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorSet

    described = FileDescriptorSet()
    file = described.file.add(name=f"{package}/{message}.proto", package=package, syntax="proto2")
    told = file.message_type.add(name=message)
    for n, field in enumerate(found):
        told.field.add(
            name=field.name, number=n + 1,
            label=FieldDescriptorProto.LABEL_OPTIONAL, type=getattr(FieldDescriptorProto, field.kind.name),
        )  # fmt: skip
        column = field.column
        words = f"`{column.name}` " if column.name != field.name else ""
        words += (f"[{column.unit}] " if column.unit else "") + column.help
        file.source_code_info.location.add(path=[*PATH_OF_FIELD, n], span=[n, 0, 0], leading_comments=words)
    return bytes(described.SerializeToString(deterministic=True))


def comment(file: Any, field: int) -> str:
    """Comment of a field of the first message of a FileDescriptorProto; "" without a comment."""
    for place in file.source_code_info.location:
        if tuple(place.path) == (*PATH_OF_FIELD, field):
            return str(place.leading_comments).strip()
    return ""


def tag(number: int, kind: Kind) -> bytes:
    """Tag bytes of a field, which precede its value."""
    value, parts = number << 3 | kind.wire, []
    while value > 0x7F:
        parts.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes((*parts, value))
