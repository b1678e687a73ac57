import pytest

from rtctl.cli import common


def test_no_machine_is_said_before_anything_is_served(rtctl, runtime, monkeypatch):
    monkeypatch.setattr(common, "running", lambda: [])
    code, out, err = rtctl("scope")
    assert (code, out) == (2, "")
    assert "no machine runs here" in err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["tcp://127.0.0.1:5"], "give the machine's name"),
        (["nobody"], "no machine 'nobody' runs here"),
        (["--port", "70000"], "--port"),
        (["--contorl"], "--contorl"),
    ],
)
def test_mistakes_are_one_line(rtctl, runtime, monkeypatch, words, message):
    monkeypatch.setattr(common, "running", lambda: [])
    code, out, err = rtctl("scope", *words)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
