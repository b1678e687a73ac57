"""Protobuf messages of one MCAP topic, decoded by the descriptor in the file, as rows of nested names.

Messages of one length with fields of fixed width, as `rtctl trace export --to mcap` writes them, are read as one array.
Other messages are decoded one by one. An absent field with presence is missing; one without presence has its default.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.trace import protobuf_rows
from rtctl.trace.imports.limits import refuse_large
from rtctl.trace.imports.messages import Columns, Messages
from rtctl.trace.imports.nested import unit_text

STAMP = "google.protobuf.Timestamp"
SPAN = "google.protobuf.Duration"
DEEPEST = 16  # levels; bounds recursive messages


class ProtobufRows:
    """Messages that are added one by one. Raises UserError for a damaged descriptor."""

    def __init__(self, path: Path, topic: str, name: str, descriptor: bytes) -> None:
        self._path, self._topic, self._data, self._bytes = path, topic, [], 0  # type: ignore[var-annotated]
        try:
            self._file, self._type = _type(name, descriptor)
        except Exception:  # protobuf raises any type for a damaged descriptor
            raise UserError(f"{path}: the descriptor of {topic} has no message {name}; the file is damaged") from None
        self._told = [_told(self._file, n, field.name) for n, field in enumerate(self._type.DESCRIPTOR.fields)]

    def add(self, data: bytes) -> None:
        """Add a message. Raises UserError where the messages exceed the memory limit."""
        self._data.append(data)
        self._bytes += len(data)
        if len(self._data) % 4096 == 0:
            refuse_large(self._path, self._bytes, f"its messages of {self._topic}")

    def units(self) -> dict[str, str]:
        """Unit of each field whose comment begins with a unit, `[rad] reference`."""
        return {name: unit_text(unit) for name, unit in self._told if unit}

    def columns(self) -> Columns:
        """Columns, nan or None where a message has no value. Raises UserError for an invalid message."""
        packed = self._packed()
        return Columns(packed, (), {}) if packed is not None else self._one_by_one().columns()

    def _packed(self) -> dict[str, np.ndarray] | None:
        """All messages read as one array; None where their width is not fixed."""
        fields = self._type.DESCRIPTOR.fields
        kinds = {number: kind for kind in protobuf_rows.KINDS.values()
                 if (number := getattr(_proto(), kind.name)) is not None}  # fmt: skip
        if not fields or any(f.type not in kinds or _repeated(f) for f in fields):
            return None
        parts: list[tuple[str, str]] = []
        for n, field in enumerate(fields):
            tag = protobuf_rows.tag(field.number, kinds[field.type])
            parts += [(f"tag{n}", f"V{len(tag)}"), (f"value{n}", kinds[field.type].dtype)]
        record = np.dtype(parts)
        if any(len(data) != record.itemsize for data in self._data):
            return None
        rows = np.frombuffer(b"".join(self._data), record)
        for n, field in enumerate(fields):
            if not (rows[f"tag{n}"] == np.void(protobuf_rows.tag(field.number, kinds[field.type]))).all():
                return None
        values = [np.ascontiguousarray(rows[f"value{n}"]) for n in range(len(fields))]
        is_bool = [kinds[field.type].wire == protobuf_rows.VARINT for field in fields]
        names = [name for name, _ in self._told]
        return {name: v.astype(bool) if b else v for name, v, b in zip(names, values, is_bool, strict=True)}

    def _one_by_one(self) -> Messages:
        rows = Messages(self._path, f"messages of {self._topic}")
        fields = self._type.DESCRIPTOR.fields
        names = {field.name: name for field, (name, _) in zip(fields, self._told, strict=True)}
        for number, data in enumerate(self._data, 1):
            try:
                message = self._type.FromString(data)
            except Exception:  # DecodeError differs between implementations
                raise UserError(
                    f"{self._path}: message {number} of {self._topic} is no {self._type.DESCRIPTOR.full_name}: "
                    f"{data[:20]!r}"
                ) from None
            rows.add({names.get(key, key): value for key, value in _plain(message, 0).items()})
        return rows


def _type(name: str, descriptor: bytes) -> tuple[Any, Any]:
    """File descriptor that declares a message (None where the message is not its first) and message class."""
    from google.protobuf import descriptor_pool, message_factory
    from google.protobuf.descriptor_pb2 import FileDescriptorSet

    pool, files = (
        descriptor_pool.DescriptorPool(),
        {file.name: file for file in FileDescriptorSet.FromString(descriptor).file},
    )
    added: set[str] = set()

    def add(file: Any) -> None:  # imported files must be added first
        if file.name in added:
            return
        added.add(file.name)
        for other in file.dependency:
            if other in files:
                add(files[other])
        pool.Add(file)

    for file in files.values():
        add(file)
    found = pool.FindMessageTypeByName(name)
    holder = files.get(found.file.name)
    first = holder is not None and holder.message_type and holder.message_type[0].name == found.name
    return holder if first else None, message_factory.GetMessageClass(found)


def _proto() -> Any:
    from google.protobuf.descriptor_pb2 import FieldDescriptorProto

    return FieldDescriptorProto


def _repeated(field: Any) -> bool:
    """Whether a field holds a list; the older attribute warns in newer versions of protobuf."""
    found = getattr(type(field), "is_repeated", None)
    return bool(field.is_repeated if found is not None else field.label == field.LABEL_REPEATED)


def _told(file: Any, number: int, name: str) -> tuple[str, str]:
    """Column and unit of a field, by its comment."""
    words = protobuf_rows.WORDS.match(protobuf_rows.comment(file, number)) if file else None
    return (words["name"] or name, words["unit"] or "") if words else (name, "")


def _plain(message: Any, depth: int) -> Any:
    """Nested mappings and lists of a message."""
    kind = message.DESCRIPTOR.full_name
    if kind in (STAMP, SPAN):
        return {"seconds": message.seconds, "nanos": message.nanos}
    if depth > DEEPEST:
        return None
    found: dict[str, Any] = {}
    for field in message.DESCRIPTOR.fields:
        value = getattr(message, field.name)
        if _repeated(field):
            if isinstance(value, Mapping) or hasattr(value, "keys"):
                continue  # keys of a map differ between messages
            found[field.name] = [_value(field, item, depth) for item in value]
        elif field.has_presence and not message.HasField(field.name):
            found[field.name] = None
        else:
            found[field.name] = _value(field, value, depth)
    return found


def _value(field: Any, value: Any, depth: int) -> Any:
    if field.message_type is not None:
        return _plain(value, depth + 1)
    return value.hex() if isinstance(value, bytes) else value
