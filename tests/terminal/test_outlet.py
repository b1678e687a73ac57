"""Output stream with a closed reader: writes are discarded, and `gone` is set."""

import io
import os

from rtctl.terminal.outlet import Outlet


def test_outlet_passes_text_to_the_stream() -> None:
    stream = io.StringIO()
    outlet = Outlet(stream)
    assert outlet.write("abc") == 3 and stream.getvalue() == "abc" and not outlet.gone


def test_pipe_without_a_reader_discards_output() -> None:
    reads, writes = os.pipe()
    with os.fdopen(writes, "w", buffering=1) as stream:
        os.close(reads)
        outlet = Outlet(stream)
        assert outlet.write("abc\n") == 4 and outlet.gone
        outlet.flush()
        assert outlet.write("more") == 4  # closing does not raise for buffered text


def test_closed_stream_discards_output() -> None:
    stream = io.StringIO()
    stream.close()
    outlet = Outlet(stream)
    assert outlet.write("abc") == 3 and outlet.gone
