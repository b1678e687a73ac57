"""The command protocol: a request and a reply, each a msgpack map. Independent of sockets.

    request  {"v": 1, "id": 7, "op": "setpoint", "args": {"value": 0.25}}
    reply    {"v": 1, "id": 7, "ok": true, "result": {...}}
             {"v": 1, "id": 7, "ok": false, "error": {"code": "refused", "message": "..."}}

A request is not trusted: its size, depth, types, keys and numbers are checked before its meaning. Any fault becomes a
ProtocolError. docs/protocol.md describes the protocol in full.
"""

import difflib
import math
import os
from collections.abc import Iterable
from typing import Annotated, Any, Literal, NamedTuple

import msgpack
from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

VERSION = 1
VERSIONS = (VERSION,)
MAX_BYTES = 64 * 1024
MAX_DEPTH = 8
MAX_MESSAGE_TEXT = 2000
LIMITS = {"max_str_len": 16 * 1024, "max_array_len": 4096, "max_map_len": 1024, "max_bin_len": 0, "max_ext_len": 0}

ERRORS = {
    "version": "the request is of a version that this daemon does not speak",
    "malformed": "the request is not a msgpack map of the form above, or holds a number that is NaN or infinite",
    "too_large": "the request or its reply is larger than 64 KiB",
    "unknown_op": "there is no op of this name",
    "bad_args": "an argument is missing, unknown, of the wrong type or out of bounds",
    "refused": "understood, but not now or not with this value; the message says why",
    "internal": "the daemon failed; its log says how. It keeps running",
}


class ProtocolError(Exception):
    """An invalid message. `code` is a key of ERRORS; `id` is the id of the request, None where it cannot be read."""

    def __init__(self, code: str, message: str, id: int | str | None = None):
        super().__init__(message)
        self.code = code
        self.message = message
        self.id = id


# No control characters: with them a client could write lines of its own into the log.
Text = Annotated[str, StringConstraints(min_length=1, max_length=256, pattern=r"^[^\x00-\x1f\x7f]+$")]
# Factors and small powers only: the unit converter would also evaluate "m**9**9**9", for a very long time.
Unit = Annotated[str, StringConstraints(max_length=32, pattern=r"^[A-Za-z%]+(\^-?\d)?([*/ ][A-Za-z%]+(\^-?\d)?)*$")]
Seconds = Annotated[float, Field(ge=0.0, le=86400.0)]


class Args(BaseModel):
    """Arguments of an op. Types are converted from int to float only; an unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class NoArgs(Args):
    """No arguments."""


class SetpointArgs(Args):
    """A new setpoint, in SI units without `unit`; `name` where a machine has several.

    `ramp` is the speed of the change, in `unit` per second or in `ramp_unit`, such as mm/s. Without it the setpoint
    steps.
    """

    name: Text | None = None
    value: float
    unit: Unit | None = None
    ramp: Annotated[float, Field(gt=0.0)] | None = None
    ramp_unit: Unit | None = None


class GetArgs(Args):
    """A setting by its dotted path in the config, such as "tension.gain"."""

    path: Text


class SetArgs(Args):
    """A new value for a setting, as it would stand in the config."""

    path: Text
    value: Any


class CaptureArgs(Args):
    """Record `seconds`, of which `pre` lie before the trigger (or before now). `out` is a path on the daemon's side."""

    seconds: Annotated[float, Field(gt=0.0, le=86400.0)]
    pre: Seconds = 0.0
    trigger: Text | None = None
    out: Text | None = None


class CaptureIdArgs(Args):
    """A capture, by the id that `capture` returned."""

    id: Text


class FaultArgs(Args):
    """`add` takes a `fault` as it would stand in the config's list, its `at` counted from now."""

    action: Literal["add", "list", "clear"]
    fault: dict[str, Any] | None = None


Sentence = Annotated[str, StringConstraints(min_length=1, max_length=2000, pattern=r"^[^\x00-\x1f\x7f]+$")]


class LaneArgs(Args):
    """A signal of the model in `rtctl watch`: `values` (n,) at the times `t` of the call."""

    unit: Unit | Literal["sigma", ""]
    values: Annotated[list[float], Field(max_length=400)]


class AlarmArgs(Args):
    """A departure from the model: controller time `t` in s, sentence, bundle, diagnosis and page."""

    t: float
    words: Sentence
    bundle: Sentence | None = None
    diagnosis: Sentence | None = None
    page: Sentence | None = None


class WatchArgs(Args):
    """Report of `rtctl watch`: `residual` by sensor in standard deviations, `lanes` (signals of the model) by name."""

    state: Literal["waiting", "learning", "watching", "astray"]
    learned: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0
    residual: Annotated[dict[Text, float], Field(max_length=32)] = {}
    t: Annotated[list[float], Field(max_length=400)] = []
    lanes: Annotated[dict[Text, LaneArgs], Field(max_length=32)] = {}
    alarm: AlarmArgs | None = None
    notes: Annotated[list[Sentence], Field(max_length=16)] = []


OPS: dict[str, type[Args]] = {
    "ping": NoArgs,
    "status": NoArgs,
    "signals": NoArgs,
    "get": GetArgs,
    "set": SetArgs,
    "setpoint": SetpointArgs,
    "arm": NoArgs,
    "disarm": NoArgs,
    "reset": NoArgs,
    "play": NoArgs,
    "stop": NoArgs,
    "fault": FaultArgs,
    "capture": CaptureArgs,
    "capture_status": CaptureIdArgs,
    "capture_stop": CaptureIdArgs,
    "watch": WatchArgs,
}


class Request(NamedTuple):
    id: int | str
    op: str
    args: Args


class Reply(NamedTuple):
    """A reply: `code` and `message` are empty after success, `result` is empty after an error."""

    id: int | str | None
    result: dict[str, Any]
    code: str
    message: str


def encode_request(id: int | str, op: str, args: dict[str, Any]) -> bytes:
    return _pack({"v": VERSION, "id": id, "op": op, "args": args})


def encode_result(id: int | str, result: dict[str, Any]) -> bytes:
    """Encoded reply with `result`. Numpy scalars, arrays and paths become numbers, lists and text.

    Raises ProtocolError if too large, TypeError, ValueError or OverflowError for values that msgpack cannot hold.
    """
    return _pack({"v": VERSION, "id": id, "ok": True, "result": result})


def encode_error(id: int | str | None, code: str, message: str) -> bytes:
    text = message.encode("utf-8", "replace").decode()[:MAX_MESSAGE_TEXT]
    return _pack({"v": VERSION, "id": id, "ok": False, "error": {"code": code, "message": text}})


def decode_request(data: bytes) -> Request:
    """The request in `data`, with typed arguments. Raises only ProtocolError, for any `data`."""
    message = _unpack(data, **LIMITS)
    id = message.get("id")
    known_id = id if _is_id(id) else None
    try:
        _check_version(message)
        _check(message, "message")
        _check_keys(message, ("v", "id", "op", "args"))
        if known_id is None:
            raise ProtocolError("malformed", "the key 'id' must be a whole number or a text of 1 to 64 characters")
        return Request(known_id, *_op_and_args(message.get("op"), message.get("args", {})))
    except ProtocolError as error:
        error.id = known_id
        raise


def decode_reply(data: bytes) -> Reply:
    """The reply in `data`. Raises ProtocolError where `data` is not a reply."""
    message = _unpack(data)
    _check_version(message)
    result, error = message.get("result", {}), message.get("error", {})
    if not isinstance(message.get("ok"), bool) or not isinstance(result, dict) or not isinstance(error, dict):
        raise ProtocolError("malformed", "the reply has no 'ok' with a 'result' or an 'error'")
    if message["ok"]:
        return Reply(message.get("id"), result, "", "")
    return Reply(message.get("id"), {}, str(error.get("code", "internal")), str(error.get("message", "no message")))


def nearest(name: str, names: Iterable[str]) -> str:
    """End of a sentence about an unknown `name`: the nearest of `names`, else all of them."""
    names = list(names)
    close = difflib.get_close_matches(name[:64], names, 1)
    return f"; did you mean '{close[0]}'?" if close else f"; expected {', '.join(names) or 'none'}"


def _op_and_args(op: Any, args: Any) -> tuple[str, Args]:
    if not isinstance(op, str):
        raise ProtocolError("malformed", "the key 'op' must be a text")
    if not isinstance(args, dict):
        raise ProtocolError("malformed", "the key 'args' must be a map")
    if op not in OPS:
        raise ProtocolError("unknown_op", f"there is no op {_short(op)}{nearest(op, OPS)}")
    try:
        return op, OPS[op].model_validate(args)
    except ValidationError as error:
        raise ProtocolError("bad_args", _explain(op, error)) from None


def _explain(op: str, error: ValidationError) -> str:
    names = OPS[op].model_fields
    sentences = []
    for fault in error.errors(include_url=False, include_input=False)[:3]:
        name = str(fault["loc"][0]) if fault["loc"] else ""
        if fault["type"] == "extra_forbidden":
            sentences.append(f"'{op}' takes no argument {_short(name)}{nearest(name, names)}")
        elif fault["type"] == "missing":
            sentences.append(f"'{op}' needs the argument '{name}'")
        elif fault["type"] == "string_pattern_mismatch":
            sentences.append(f"argument '{name}' of '{op}' holds characters that are not taken there")
        else:
            sentences.append(f"argument '{name}' of '{op}': {fault['msg']}")
    return ". ".join(sentences)


def _check_version(message: dict[str, Any]) -> None:
    version = message.get("v")
    if not isinstance(version, int) or isinstance(version, bool):
        raise ProtocolError("malformed", f"the key 'v' must be the protocol version, {VERSION}")
    if version not in VERSIONS:
        spoken = ", ".join(map(str, VERSIONS))
        raise ProtocolError("version", f"version {version} is not spoken here; versions spoken: {spoken}")


def _check_keys(message: dict[str, Any], names: tuple[str, ...]) -> None:
    for key in message:
        if key not in names:
            raise ProtocolError("malformed", f"unknown key {_short(key)}{nearest(key, names)}")


def _check(value: Any, where: str, depth: int = 0) -> None:
    if depth > MAX_DEPTH:
        raise ProtocolError("malformed", f"nested deeper than {MAX_DEPTH} levels")
    if isinstance(value, dict):
        for key, item in value.items():
            if not isinstance(key, str):
                raise ProtocolError("malformed", f"a key in {where} is not a text")
            _check(item, _short(key), depth + 1)
    elif isinstance(value, list):
        for item in value:
            _check(item, where, depth + 1)
    elif isinstance(value, float):
        if not math.isfinite(value):
            raise ProtocolError("malformed", f"{where} is {value}, not a finite number")
    elif value is not None and not isinstance(value, (bool, int, str)):
        raise ProtocolError("malformed", f"{where} is of a type that is not taken; send numbers, texts, lists and maps")


def _is_id(id: Any) -> bool:
    return (isinstance(id, int) and not isinstance(id, bool)) or (isinstance(id, str) and 0 < len(id) <= 64)


def _short(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:37] + "...")


def _pack(message: dict[str, Any]) -> bytes:
    data = msgpack.packb(message, default=_plain)
    if len(data) > MAX_BYTES:
        raise ProtocolError("too_large", f"a message of {len(data)} bytes; at most {MAX_BYTES} are taken")
    return data


def _plain(value: Any) -> Any:
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} cannot be sent; send numbers, texts, lists and maps")


def _unpack(data: bytes, **limits: int) -> dict[str, Any]:
    if len(data) > MAX_BYTES:
        raise ProtocolError("too_large", f"a message of {len(data)} bytes; at most {MAX_BYTES} are taken")
    try:
        message = msgpack.unpackb(data, ext_hook=_no_ext, object_pairs_hook=_unique, strict_map_key=True, **limits)
    except (ValueError, TypeError, OverflowError, RecursionError, msgpack.UnpackException) as error:
        raise ProtocolError(
            "malformed", f"not a msgpack map within the limits: {str(error) or 'nested too deep'}"
        ) from None
    if not isinstance(message, dict):
        raise ProtocolError("malformed", "the message is not a msgpack map")
    return message


def _unique(pairs: list[tuple[Any, Any]]) -> dict[Any, Any]:
    made = dict(pairs)
    if len(made) != len(pairs):
        raise ValueError("a key occurs twice in one map")
    return made


def _no_ext(code: int, data: bytes) -> Any:
    raise ValueError(f"extension type {code} is not taken")
