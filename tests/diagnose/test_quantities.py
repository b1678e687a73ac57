"""Units and nouns of an axis from the units of its columns, in every text that a diagnosis writes."""

import json
import re
from io import StringIO
from itertools import product

import numpy as np
import pytest
from rich.console import Console

from rtctl.diagnose import report, words
from rtctl.diagnose.case import read_case
from rtctl.diagnose.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED, Diagnosis, Effect, Interval, Rival, as_json
from rtctl.diagnose.experiment import called, limits_of
from rtctl.diagnose.export import write_model
from rtctl.diagnose.kernel import OPEN
from rtctl.diagnose.locate import along, where
from rtctl.diagnose.missing import Missing
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.motions import MENU
from rtctl.diagnose.preflight import preflight
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.quantities import node_words, quantities
from rtctl.diagnose.record import check
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.uncertainty import plant_unit
from rtctl.plants.physics import TERMS, nodes

PLACES = [(name, node) for name, term in TERMS.items() for node in nodes(term, "axis")]
NODE_IDS = re.compile(r"[\w.]+:carriage|\"?node\"?: \"?carriage|\"carriage\": |- carriage")  # as configs name the node
NUMBER = r"(?:(?<=\d )|(?<=, )|(?<=in )|(?<=\[))"  # a unit stands behind a number, or at the end of a label
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
    """What a text of an axis with these units must not hold, each with what stands around it."""
    text = NODE_IDS.sub("", text)
    text = re.sub(r"phi\d? = \S+ [mu]?rad", "", text)  # a phase is an angle on any axis
    found = list((SLIDES if x == "rad" else TURNS).finditer(text))
    found += re.finditer(rf"{NUMBER}[mu]?V\b|\bvolt", text) if u != "V" else []
    return [text[max(0, m.start() - 50) : m.end() + 30] for m in found]


def effect(name: str, node: str, value: float) -> Effect:
    """A term with a value for each of its numbers and all that it can be taken for on an axis."""
    fields = TERMS[name].settings.model_fields
    numbers = [n for n, f in fields.items() if f.annotation in (float, float | None)]
    alike = [Rival(other, n, 0.1, 1.0) for other in TERMS[name].look_alikes for n in nodes(TERMS[other], "axis")]
    numbers += ["F_added"] * (name == "friction.coulomb")
    return Effect(name, node, 0.9, {n: Interval(value, 0.9 * value, 1.1 * value) for n in numbers}, tuple(alike))


@pytest.fixture(scope="module", params=SHAPES)
def shape(request):
    """Units of x and u, and the diagnosis of an axis that is all that the library knows."""
    x_unit, u_unit = SHAPES[request.param]
    gain = {"V": "newton_metre_per_volt" if x_unit == "rad" else "newton_per_volt", "A": "newton_metre_per_ampere"}
    case = read_case(
        {
            "format": 1, "plant": "axis", "sample_rate": 500.0, "parameters": {"M": 0.02, "F_v": 0.04, "F_c": 0.01},
            "drive": {**({gain[u_unit]: 0.1} if u_unit in gain else {}), "unit": u_unit, "limit_volt": 5.0},
            "sensors": {"unit": x_unit}, "delay_samples": 0.0, "controller": {"kind": "none"},
        },
        "axis",
    )  # fmt: skip
    t = np.arange(1500) / 500.0
    u = np.clip(0.8 * np.sin(2 * np.pi * t) + 0.4 * np.sin(9 * np.pi * t), -0.7, 1.1)
    zero = np.zeros_like(t)
    model = owner_model(case)
    after = model.add(TERMS["friction.coulomb"].settings(node="carriage", F_C=0.01))
    blank = check({"t": t, "ref": zero, "w": zero, "u": u, "x": np.sin(t)}, case)
    x = Simulator(blank).run(after, OPEN)[:, 0]
    record = check({"t": t, "ref": zero, "w": zero, "u": u, "x": np.round(x / 1e-4) * 1e-4}, case)
    effects = tuple(effect(name, node, 0.0123) for name, node in PLACES)
    fitted = {n: Interval(v, 0.9 * v, 1.1 * v, plant_unit(model, n)) for n, v in model.base.items()}
    told = {f"{name}:{node}": Interval(0.01, 0.01, 0.01, next(iter(effects[k].parameters))) for k, (name, node) in
            enumerate(PLACES)}  # fmt: skip
    d = Diagnosis(
        record, preflight(record), NAMED, effects, None, fitted, model, model, after, 0.3, 0.1, 0.08, (), 0.08,
        tuple(f"{name}:{node}" for name, node in PLACES), told, None, (100, 1100), 1.0,
    )  # fmt: skip
    return x_unit, u_unit, d


@pytest.mark.parametrize(
    ("x", "u", "inertia", "force", "gain", "body"),
    [
        (None, "V", "kg", "N", "N/V", "the carriage"),
        ("m", "N", "kg", "N", "", "the carriage"),
        ("rad", "A", "kg m^2", "Nm", "Nm/A", "the rotor"),
        ("rad", "Nm", "kg m^2", "Nm", "", "the rotor"),
    ],
)
def test_units_follow_from_the_columns(x, u, inertia, force, gain, body):
    q = quantities(x, u)
    assert (q.of("M"), q.of("F_c"), q.of("K"), q.body) == (inertia, force, gain, body)


def test_a_rotary_axis_has_a_rotor_and_newton_metres():
    turns, slides = quantities("rad"), quantities("m")
    assert node_words("carriage", turns) == "the rotor"
    assert words.unit_at("axis", "friction.coulomb", "carriage", "F_C", turns) == "Nm"
    assert words.unit_at("axis", "transmission.backlash", "sensor", "gap", turns) == "rad"
    assert words.unit_at("axis", "guide.thickness", "sensor", "A", turns) == "rad"
    assert words.unit_at("axis", "friction.coulomb", "carriage", "F_C", slides) == "N"
    assert "rotor" in words.sentence("friction.coulomb:carriage", units=turns)


def test_what_a_drive_does_is_in_the_unit_of_its_command():
    for unit in ("V", "A", "Nm"):
        assert words.unit_at("axis", "drive.offset", "drive", "offset", quantities("rad", unit)) == unit
        assert words.unit_at("axis", "drive.supply_sag", "drive", "k", quantities("rad", unit)) == f"1/{unit}"


def test_wrong_words_are_seen():
    for text in ("590 mN", "1.7 mm of play", "the carriage", "speed, m/s", "0.02 kg", "position, um", "2 Ns/m"):
        assert wrong(text, "rad", "V"), text
    for text in ("590 mNm", "2 kg m^2", "3 ms", "4 mrad", "0.1 Nm/V", "node: carriage", "friction.coulomb:carriage"):
        assert not wrong(text, "rad", "V"), text
    assert wrong("3 mNm", "m", "V") and wrong("12 mV", "rad", "Nm") and not wrong("2 N", "m", "N")


@pytest.mark.parametrize("value", [0.0123, -0.0123])
def test_every_phrase_of_every_term_at_every_node(shape, value):
    x, u, d = shape
    for name, node in PLACES:
        found = effect(name, node, value)
        entry = f"{name}:{node}"
        text = [*words.effect_clause(found, d.after), words.at(entry, d.after.units), words.need(entry)]
        text += [words.entry_noun(entry, d.after.units), words.sentence(entry, units=d.after.units)]
        text += [words.hidden_size(d, entry), *called([entry, "nothing"], d.after.units)]
        text += [t for other, t in TERMS[name].look_alikes.items() if nodes(TERMS[other], "axis")]
        text += [" ".join(map(str, row)) for row in report.effect_rows(d._replace(effects=(found,)))]
        assert wrong("\n".join(text), x, u) == [], name


def test_every_verdict_on_the_console_and_in_json(shape):
    x, u, d = shape
    plain = d._replace(effects=(), after=d.before)
    verdicts = [
        d, d._replace(verdict=AMBIGUOUS), d._replace(verdict=UNNAMED, untestable=d.cannot_test),
        plain._replace(verdict=UNNAMED), plain._replace(verdict=UNNAMED, unpredicted=True),
        plain._replace(verdict=UNNAMED, resembles=("load.bump", "carriage")), plain._replace(verdict=NOTHING),
    ]  # fmt: skip
    for made in verdicts:
        out = StringIO()
        Console(file=out, width=10_000).print(report.terminal(made))
        assert wrong(out.getvalue() + words.verdict_sentences(made) + words.falls(made), x, u) == []
        assert wrong(json.dumps(as_json(made)), x, u) == []


def test_report_and_model(shape, tmp_path):
    x, u, d = shape
    page = re.sub(r"<style.*?</style>|<[^>]*>", " ", report.html(d._replace(verdict=AMBIGUOUS)), flags=re.S)
    assert wrong(page, x, u) == []
    model = write_model(d.after, d.record, tmp_path / "model.yaml").read_text()
    left = [line for line in model.splitlines() if ": read " not in line]  # what stands for what in a config
    assert wrong("\n".join(left), x, u) == []


def test_axes_of_figures_and_places_of_errors(shape):
    x, u, d = shape
    sim = Simulator(d.record)
    map_, problem = Missing(d, sim), Problem(sim)
    for axis, (name, node) in product((*along(sim), "angle", "tension"), PLACES):
        labels = [*map_.of(name, node)[2:], *map_.abscissa(axis, node)[1:]]
        assert wrong("\n".join(f"error, {text}" for text in labels), x, u) == []
    for axis, values in along(sim).items():
        v = values[problem.rows]
        v = v[: len(v) // problem.mean * problem.mean].reshape(-1, problem.mean).mean(axis=1)
        error = 1.0 * (v > np.quantile(v, 0.875))
        assert re.match(f"{axis} [^a-z]", where(sim, problem, error, axis))
        assert wrong(where(sim, problem, error, axis), x, u) == []


def test_motions_of_the_next_experiment(shape):
    x, u, d = shape
    limits = limits_of(Simulator(d.record))
    for make in MENU:
        assert wrong(make(limits, 1.0).words, x, u) == []


@pytest.mark.parametrize("way", ["small", "one way", "even"])
def test_findings_of_preflight(shape, way):
    x, u, d = shape
    t = d.record.t
    motion = {"small": 0.1 * np.sin(t), "one way": 40.0 * t + np.sin(30 * t), "even": 3.0 * t}[way]
    found = preflight(d.record._replace(y={"x": motion}))
    assert found.findings and wrong("\n".join(found.findings), x, u) == []
