import numpy as np
import pytest

from rtctl.loop import generate
from rtctl.tick import frames


@pytest.mark.parametrize("dtype", [frames.OUTPUTS, frames.INPUTS])
def test_frame_records_have_no_padding_and_are_little_endian(dtype: np.dtype) -> None:
    fields = [dtype[name] for name in dtype.names or ()]
    assert fields and dtype.itemsize == sum(field.itemsize for field in fields)
    assert all(field.base.str[0] == "<" for field in fields)


@pytest.mark.parametrize("name", ["tx", "rx"])
@pytest.mark.parametrize(
    ("field", "value", "valid"),
    [
        ("seq", 0, True),
        ("seq", 2**62, True),
        ("seq", frames.HELLO, False),
        ("magic", 0x52544354, False),
        ("version", frames.VERSION + 1, False),
        ("version", 0, False),
    ],
)
def test_only_frames_of_this_protocol_are_valid(name: str, field: str, value: int, valid: bool) -> None:
    frame = generate.new_frames()[name]
    frame[field] = value
    assert frames.valid(frame[0]) == valid
