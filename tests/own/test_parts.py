import inspect
import re

import pytest
from own_lines import line

from rtctl.own import law as own_law
from rtctl.own.files import OwnError, Source, trust
from rtctl.own.parts import builtin, camel, own, upper


def parts(text, name="Try"):
    trust([text])
    return own(Source("./try.py", name, text), own_law.FUNCTIONS, own_law.RESULT)


def test_class_and_function_names_of_a_user_file():
    assert [upper(n) for n in ("Try", "MyLaw", "Pd2", "PiVelocity")] == ["TRY", "MY_LAW", "PD2", "PI_VELOCITY"]
    assert [camel(n) for n in ("pd", "my_law", "pi_velocity")] == ["Pd", "MyLaw", "PiVelocity"]


@pytest.mark.parametrize("kind", ["pd", "pi_velocity", "sections"])
def test_shipped_laws_satisfy_the_interface_of_user_laws(kind):
    found = builtin(f"rtctl.laws.{kind}", camel(kind))
    assert found.has("step") and found.has("reset")
    assert set(own_law.SIGNALS) >= set(inspect.signature(found.module.step.py_func).parameters) - {
        "p",
        "s",
    }


def test_law_receives_the_signals_it_names(law):
    found = parts(law(changes={"step(p, s, e)": "step(p, s, ref, e)"}))
    text = found.call("step", "position", {"e": "y.error", "ref": "y.ref"})
    assert text == f"{found.module.__name__}.step(p.position, s.position, y.ref, y.error)"


@pytest.mark.parametrize(
    ("name", "changes", "where", "message"),
    [
        ("Tri", {}, None, "there is no class TriSettings; did you mean ./try.py:Try?"),
        ("TrySettings", {}, None, "there is no class TrySettingsSettings; did you mean ./try.py:Try?"),
        ("Try", {"TrySettings(Settings)": "TrySettings"}, "class TrySettings", "TrySettings is not a Settings"),
        ("Try", {"TRY_STATE": "TRI_STATE"}, None, "TRY_STATE is missing; write TRY_STATE = state("),
        ("Try", {"state(n=int, x=(float, 3))": "3"}, "TRY_STATE", "TRY_STATE is no record with fields"),
        ("Try", {"def reset": "def rest"}, "def rest", "there is no function reset; did you mean 'rest'?"),
        (
            "Try",
            {"def build(settings, dt)": "def build(settings)"},
            "def build",
            "build(settings) should be def build(",
        ),
        ("Try", {"@tick\ndef step": "def step"}, "def step", "step is not compiled; write @tick above it"),
        ("Try", {"step(p, s, e)": "step(s, p, e)"}, "def step", "step(s, p, e) should be @tick def step(p, s, e):"),
        ("Try", {"    gain: float = q": "    kind: str = 'x'\n    gain: float = q"}, "class Try", "TrySettings.kind:"),
    ],
)
def test_missing_part_error_shows_the_expected_form(law, name, changes, where, message):
    text = law(changes=changes)
    at = f":{line(text, where)}" if where else ""
    with pytest.raises(OwnError, match=f"^{re.escape(f'./try.py{at}: {message}')}"):
        parts(text, name)


def test_unknown_signal_is_refused(law):
    text = law(changes={"step(p, s, e)": "step(p, s, e, v_rfe)"})
    with pytest.raises(
        OwnError, match=r"step\(p, s, e, v_rfe\): there is no signal 'v_rfe' here; did you mean 'v_ref'\?"
    ):
        parts(text).call("step", "position", {"e": "e", "v_ref": "v"})


def test_build_must_return_params(law):
    found = parts(law(changes={"return TryParams(settings.gain)": "return 3.0"}))
    with pytest.raises(OwnError, match=r"build gives a float; it should give a TryParams, a NamedTuple"):
        found.build(found.settings(gain=1), 1e-3)
    found = parts(law(changes={"TryParams(settings.gain)": "TryParams('x')"}))
    with pytest.raises(OwnError, match=r"TryParams\.gain is a str; the tick takes numbers"):
        found.build(found.settings(gain=1), 1e-3)
    found = parts(law(changes={"settings.gain)": "settings.gian)"}))
    with pytest.raises(OwnError, match=r"build: AttributeError"):
        found.build(found.settings(gain=1), 1e-3)
