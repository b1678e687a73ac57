"""Units and nouns of an axis follow the units of its columns in every text of a diagnosis."""

import re

import pytest

from rtctl.case.quantities import quantities
from rtctl.diagnose.evidence.diagnosis import Effect, Interval, LookAlike
from rtctl.plants.physics import TERMS, nodes

PLACES = [(name, node) for name, term in TERMS.items() for node in nodes(term, "axis")]
NODE_IDS = re.compile(r"[\w.]+:carriage|\"?node\"?: \"?carriage|\"carriage\": |- carriage")  # node name in configs
NUMBER = r"(?:(?<=\d )|(?<=, )|(?<=in )|(?<=\[))"  # a unit follows a number or ends a label
SLIDES = re.compile(
    rf"{NUMBER}(?:[numk]?(?:m|N)(?:/s|/V|/A|/m)?|[numk]?Ns/m|kg)(?![\w^*]| m\^2)"
    r"|N\*s/m|carriage|\b(?:slides|sliding)|\bstrokes?\b|millimetre|micron"
)
TURNS = re.compile(rf"{NUMBER}[numk]?(?:rad|Nm)\b|Nm/|rotor|kg m\^2|torque")
SHAPES = {  # units of x and u
    "rotary, volt": ("rad", "V"), "rotary, torque": ("rad", "Nm"), "rotary, ampere": ("rad", "A"),
    "sliding, volt": ("m", "V"), "sliding, force": ("m", "N"),
}  # fmt: skip


def wrong(text: str, x: str, u: str) -> list[str]:
    """Wrong units and nouns in a text of an axis with these units, each with its context."""
    text = NODE_IDS.sub("", text)
    text = re.sub(r"phi\d? = \S+ [mu]?rad", "", text)  # a phase is an angle for any axis
    found = list((SLIDES if x == "rad" else TURNS).finditer(text))
    found += re.finditer(rf"{NUMBER}[mu]?V\b|\bvolt", text) if u != "V" else []
    return [text[max(0, m.start() - 50) : m.end() + 30] for m in found]


def effect(name: str, node: str, value: float) -> Effect:
    """A term with a value for each parameter and all its equivalent terms on an axis."""
    fields = TERMS[name].settings.model_fields
    numbers = [n for n, f in fields.items() if f.annotation in (float, float | None)]
    alike = [LookAlike(other, n, 0.1) for other in TERMS[name].look_alikes for n in nodes(TERMS[other], "axis")]
    numbers += ["F_added"] * (name == "friction.coulomb")
    return Effect(name, node, 0.9, {n: Interval(value, 0.9 * value, 1.1 * value) for n in numbers}, tuple(alike))


@pytest.mark.parametrize(
    ("x", "u", "inertia", "force", "gain", "body"),
    [
        (None, "V", "kg", "N", "N/V", "the carriage"),
        ("m", "N", "kg", "N", "", "the carriage"),
        ("rad", "A", "kg m^2", "Nm", "Nm/A", "the rotor"),
        ("rad", "Nm", "kg m^2", "Nm", "", "the rotor"),
    ],
)
def test_units_in_texts_follow_the_columns(x, u, inertia, force, gain, body):
    q = quantities(x, u)
    assert (q.of("M"), q.of("F_c"), q.of("K"), q.body) == (inertia, force, gain, body)


def test_wrong_units_and_nouns_are_detected():
    for text in ("590 mN", "1.7 mm of play", "the carriage", "speed, m/s", "0.02 kg", "position, um", "2 Ns/m"):
        assert wrong(text, "rad", "V"), text
    for text in ("590 mNm", "2 kg m^2", "3 ms", "4 mrad", "0.1 Nm/V", "node: carriage", "friction.coulomb:carriage"):
        assert not wrong(text, "rad", "V"), text
    assert wrong("3 mNm", "m", "V") and wrong("12 mV", "rad", "Nm") and not wrong("2 N", "m", "N")
