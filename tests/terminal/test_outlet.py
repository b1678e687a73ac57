"""A stream whose reader has gone takes everything, and says that it is gone."""

import io
import os

from rtctl.terminal.outlet import Outlet


def test_it_passes_on_what_is_written() -> None:
    stream = io.StringIO()
    outlet = Outlet(stream)
    assert outlet.write("abc") == 3 and stream.getvalue() == "abc" and not outlet.gone


def test_a_pipe_without_a_reader() -> None:
    reads, writes = os.pipe()
    with os.fdopen(writes, "w", buffering=1) as stream:
        os.close(reads)
        outlet = Outlet(stream)
        assert outlet.write("abc\n") == 4 and outlet.gone
        outlet.flush()
        assert outlet.write("more") == 4  # nor does closing raise what waits in the buffer


def test_a_stream_that_was_closed_here() -> None:
    stream = io.StringIO()
    stream.close()
    outlet = Outlet(stream)
    assert outlet.write("abc") == 3 and outlet.gone
