import math

import msgpack
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rtctl.daemon import protocol
from rtctl.daemon.protocol import (
    ProtocolError,
    decode_reply,
    decode_request,
    encode_error,
    encode_request,
    encode_result,
)

GOOD = {"v": 1, "id": 1, "op": "setpoint", "args": {"value": 1.0}}
INTEGERS = st.integers(-(2**63), 2**64 - 1)  # range of msgpack integers
ANYTHING = st.recursive(
    st.none() | st.booleans() | INTEGERS | st.floats() | st.text() | st.binary(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text() | st.binary() | INTEGERS, inner, max_size=4),
    max_leaves=20,
)


def refusal(message):
    data = message if isinstance(message, bytes) else msgpack.packb(message)
    with pytest.raises(ProtocolError) as caught:
        decode_request(data)
    assert caught.value.code in protocol.ERRORS
    return caught.value


def nested(depth):
    value = 1.0
    for _ in range(depth):
        value = [value]
    return {**GOOD, "op": "set", "args": {"path": "a", "value": value}}


def test_encoded_request_decodes_to_typed_arguments():
    request = decode_request(
        encode_request("a-1", "setpoint", {"value": 3, "unit": "m/s^2", "ramp": 2.0, "ramp_unit": "mm/s"})
    )
    assert request.id == "a-1"
    assert request.args == protocol.SetpointArgs(value=3.0, unit="m/s^2", ramp=2.0, ramp_unit="mm/s")


def test_args_may_be_left_out():
    assert decode_request(msgpack.packb({"v": 1, "id": 1, "op": "arm"})).args == protocol.NoArgs()


@settings(deadline=None)
@given(st.binary(max_size=200))
@example(b"")
@example(b"\x91" * 60_000)  # deeper than any stack
@example(b"\xdd\xff\xff\xff\xff")  # a list that claims four thousand million items
@example(b"\xdf\xff\xff\xff\xff")
@example(b"\xc7\x00\xff")  # a time stamp of no length
@example(b"\xd6\xff\x00\x00\x00\x00")
def test_random_bytes_raise_only_protocol_errors(data):
    try:
        decode_request(data)
    except ProtocolError as error:
        assert error.code in protocol.ERRORS
        encode_error(error.id, error.code, error.message)


@settings(deadline=None)
@given(
    st.dictionaries(st.sampled_from(["v", "id", "op", "args", "x"]), ANYTHING) | ANYTHING,
    st.sampled_from(list(protocol.OPS)),
    st.dictionaries(st.sampled_from(["value", "path", "unit", "ramp", "seconds", "id"]), ANYTHING),
    st.booleans(),
)
def test_random_messages_raise_only_protocol_errors(message, op, args, plausible):
    if plausible and isinstance(message, dict):
        message = {**message, "v": 1, "id": 1, "op": op, "args": args}
    try:
        request = decode_request(msgpack.packb(message))
    except ProtocolError as error:
        decode_reply(encode_error(error.id, error.code, error.message))
    else:
        assert type(request.args) is protocol.OPS[request.op]


@settings(deadline=None)
@given(st.binary(max_size=100) | ANYTHING.map(msgpack.packb))
def test_random_replies_raise_only_protocol_errors(data):
    try:
        decode_reply(data)
    except ProtocolError as error:
        assert error.code in protocol.ERRORS


def test_unknown_version_error_lists_the_supported_versions():
    error = refusal({**GOOD, "v": 2, "novelty": []})
    assert (error.code, error.id) == ("version", 1)
    assert "versions spoken: 1" in error.message


@pytest.mark.parametrize("version", [None, True, 1.0, "1"])
def test_version_must_be_an_integer(version):
    assert refusal({**GOOD, "v": version}).code == "malformed"


def test_oversize_message_is_refused_before_decoding():
    assert refusal(b"\xc1" * (protocol.MAX_BYTES + 1)).code == "too_large"
    with pytest.raises(ProtocolError, match="at most 65536"):
        encode_result(1, {"text": "x" * protocol.MAX_BYTES})


def test_nesting_depth_is_bounded():
    assert decode_request(msgpack.packb(nested(protocol.MAX_DEPTH - 2)))
    assert "nested deeper" in refusal(nested(protocol.MAX_DEPTH - 1)).message


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_numbers_must_be_finite(number):
    error = refusal({**GOOD, "args": {"value": number}})
    assert error.code == "malformed"
    assert "'value' is" in error.message
    assert refusal({**GOOD, "op": "set", "args": {"path": "a", "value": [0.0, {"b": number}]}}).code == "malformed"


@pytest.mark.parametrize(
    "value", [b"bytes", msgpack.Timestamp(0), msgpack.ExtType(4, b"x"), "x" * 20_000, [0] * 5000, {1: 2}]
)
def test_unsupported_types_and_sizes_are_refused(value):
    assert refusal({**GOOD, "op": "set", "args": {"path": "a", "value": value}}).code == "malformed"


def test_duplicate_map_key_is_refused():
    pair = msgpack.packb("v") + msgpack.packb(1)
    assert "twice" in refusal(b"\x82" + pair + pair).message


@pytest.mark.parametrize("id", [None, True, 1.5, "", "x" * 65, [1]])
def test_invalid_request_id_is_refused(id):
    error = refusal({**GOOD, "id": id})
    assert (error.code, error.id) == ("malformed", None)


@pytest.mark.parametrize(
    ("change", "code", "words"),
    [
        ({"agrs": {}}, "malformed", "did you mean 'args'"),
        ({"op": "setpiont"}, "unknown_op", "did you mean 'setpoint'"),
        ({"op": "zzz"}, "unknown_op", "expected ping, status"),
        ({"op": 3}, "malformed", "'op' must be a text"),
        ({"args": [1]}, "malformed", "'args' must be a map"),
        ({"args": {"value": 1.0, "rmap": 2.0}}, "bad_args", "did you mean 'ramp'"),
        ({"args": {}}, "bad_args", "needs the argument 'value'"),
        ({"args": {"value": "1"}}, "bad_args", "valid number"),
        ({"args": {"value": True}}, "bad_args", "valid number"),
        ({"args": {"value": 1.0, "ramp": -1.0}}, "bad_args", "'ramp'"),
        ({"args": {"value": 1.0, "unit": "m**9**9**9"}}, "bad_args", "characters"),
        ({"args": {"value": 1.0, "name": "a\nb"}}, "bad_args", "characters"),
        ({"op": "arm"}, "bad_args", "takes no argument 'value'; expected none"),
        ({"op": "capture", "args": {"seconds": 0.0}}, "bad_args", "'seconds'"),
    ],
)
def test_error_message_explains_the_mistake(change, code, words):
    error = refusal({**GOOD, **change})
    assert error.code == code
    assert error.id == 1
    assert words in error.message


def test_results_may_hold_numpy_and_nan(tmp_path):
    reply = decode_reply(encode_result(4, {"a": np.arange(3.0), "n": np.int64(2), "x": math.nan, "out": tmp_path}))
    assert reply.id == 4
    assert (reply.result["a"], reply.result["n"], reply.result["out"]) == ([0.0, 1.0, 2.0], 2, str(tmp_path))
    assert math.isnan(reply.result["x"])


def test_error_messages_are_bounded():
    reply = decode_reply(encode_error(None, "internal", "\ud800" + "ü" * 10_000))
    assert (reply.id, reply.code, len(reply.message)) == (None, "internal", protocol.MAX_MESSAGE_TEXT)
