"""Messages for refused system calls: path and remedy."""

import errno
import os
from concurrent.futures.process import BrokenProcessPool

import pytest
import yaml
import zmq

from rtctl.config.failures import ADVICE, told, words


@pytest.mark.parametrize("number", ADVICE, ids=lambda number: errno.errorcode[number])
def test_each_refused_system_call_names_the_path_and_the_remedy(number: int) -> None:
    said = words(OSError(number, os.strerror(number), "/data/run"))
    assert said is not None and said.startswith("/data/run: ") and said.endswith(ADVICE[number])


def test_system_error_behind_another_exception_is_found() -> None:
    try:
        try:
            raise OSError(errno.ENOSPC, "No space left on device")
        except OSError as error:
            raise RuntimeError("while it was written") from error
    except RuntimeError as error:
        assert words(error) == f"no space left on device; {ADVICE[errno.ENOSPC]}"
    assert "open files" in str(words(zmq.ZMQError(errno.EMFILE)))
    assert "killed" in str(words(BrokenProcessPool("a child process terminated abruptly")))
    assert "memory" in str(words(MemoryError()))


def test_program_errors_have_no_user_message() -> None:
    assert words(ValueError("x")) is None and words(OSError(errno.EINVAL, "Invalid argument")) is None


def test_unloadable_library_is_not_an_internal_error() -> None:
    """As under `ulimit -v` and `ulimit -n`."""
    error = ImportError("\n\nREAD THIS\nOriginal error was: libarrow.so.2600: failed to map segment from shared object")
    assert told(error)[0] == 2 and "libarrow.so.2600: failed to map segment" in told(error)[1]
    assert words(ImportError("cannot import name 'x' from 'y'")) is None


def test_invalid_numba_settings_file_is_named() -> None:
    mark = yaml.Mark(".numba_config.yaml", 0, 0, 0, None, 0)
    assert "another folder" in str(words(yaml.scanner.ScannerError(None, None, "oh", mark)))


def test_program_error_is_reported_as_internal_error(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    code, said = told(ZeroDivisionError("oh"))
    assert code == 1 and said.startswith("internal error: ZeroDivisionError('oh')")
    monkeypatch.setenv("RTCTL_TRACEBACK", "1")
    told(ZeroDivisionError("oh"))
    assert "ZeroDivisionError: oh" in capsys.readouterr().err
